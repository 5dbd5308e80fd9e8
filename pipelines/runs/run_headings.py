"""What pictures of runs say above them: verdict, sizes and dates."""

from collections.abc import Sequence
from datetime import datetime, timezone

from racecar.localization.verdict.drive_quality import DriveQuality
from racecar.mapping.quality.map_quality import MapQuality
from racecar.mapping.session.recordings import Recording
from racecar.pipelines.files.pictures.heading import Badge, Heading
from racecar.pipelines.files.tone import TONE_OF_VERDICT

_CLOCKS_BEGAN = datetime(2000, 1, 1, tzinfo=timezone.utc)
"""Earlier dates are those of clocks that nobody set."""
_LONG = 120.0
"""Seconds from which times are given in minutes."""


def heading(
    title: str,
    quality: MapQuality | DriveQuality,
    path_metres: float,
    recordings: Sequence[Recording],
    facts: Sequence[str] = (),
) -> Heading:
    """The heading of a map or drive: ``facts``, then how far the car drove in the recordings, and when."""
    badge = Badge(quality.verdict.value, TONE_OF_VERDICT[quality.verdict.value])
    seconds = sum(each.end - each.begin for each in recordings) * 1e-9
    time = f"{seconds:.0f} s" if seconds < _LONG else f"{seconds / 60:.0f} min"
    driven = f"{path_metres:.0f} m driven in {time}"
    return Heading(title, badge, (*facts, driven, *_dates(recordings)), quality.summary)


def _dates(recordings: Sequence[Recording]) -> list[str]:
    """When the recordings were made, if their clocks were set; of several the first and the last."""
    days = [datetime.fromtimestamp(each.begin * 1e-9, timezone.utc) for each in recordings]
    known = sorted(day for day in days if day > _CLOCKS_BEGAN)
    if not known:
        return []
    if len(recordings) == 1:
        return [f"{known[0]:%Y-%m-%d %H:%M} UTC"]
    first_and_last = dict.fromkeys(f"{day:%Y-%m-%d}" for day in (known[0], known[-1]))
    return [f"{len(recordings)} drives, {' to '.join(first_and_last)}"]
