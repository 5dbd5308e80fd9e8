"""What is written above the pictures of runs."""

from racecar.mapping.quality.map_quality import MapQuality, Verdict
from racecar.mapping.session.recordings import Recording
from racecar.pipelines.files.tone import Tone
from racecar.pipelines.runs.run_headings import heading

NOON = 1_767_355_200 * 10**9  # 2026-01-02 12:00 UTC
DAY = 86_400 * 10**9
GOOD = MapQuality(Verdict.GOOD, 0.02, 0.05, (), (), {})


def facts(*recordings: Recording) -> tuple[str, ...]:
    return heading("drive", GOOD, 12.3, recordings, ("cells of 5 cm",)).facts


def test_a_drive_has_length_duration_and_date() -> None:
    recording = Recording("drive", NOON, NOON + 90 * 10**9)
    assert facts(recording) == ("cells of 5 cm", "12 m driven in 90 s", "2026-01-02 12:00 UTC")


def test_the_date_of_a_clock_that_was_not_set_is_not_shown() -> None:
    assert facts(Recording("drive", 10**9, 301 * 10**9)) == ("cells of 5 cm", "12 m driven in 5 min")


def test_of_several_drives_the_first_and_the_last_day_are_named() -> None:
    drives = [Recording(f"{n}", NOON + n * DAY, NOON + n * DAY + 60 * 10**9) for n in (3, 0, 1)]
    assert facts(*drives)[1:] == ("12 m driven in 3 min", "3 drives, 2026-01-02 to 2026-01-05")
    assert facts(drives[1], drives[1])[2] == "2 drives, 2026-01-02"


def test_the_verdict_is_the_badge_and_the_summary_the_sentence() -> None:
    above = heading("drive", GOOD, 12.3, [])
    assert above.badge is not None
    assert (above.badge.word, above.badge.tone) == ("good", Tone.GOOD)
    assert above.sentence == GOOD.summary
