"""The verdict on a whole drive, and on whether its map is the right one."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.verdict import unknown_segments
from racecar.localization.verdict.drive_judge import DriveJudge
from racecar.localization.verdict.drive_quality import DriveVerdict
from racecar.localization.verdict.map_fit import MapFit
from racecar.localization.verdict.pose_steps import PoseSteps
from tests.localization.verdict.estimates import RIGHT, WRONG, estimate, straight_drive

LOCALIZED, UNCERTAIN, LOST = DriveVerdict


def judged(*estimates: PoseEstimate) -> DriveJudge:
    judge = DriveJudge()
    for each in estimates:
        judge.follow(each)
    return judge


def lost_for(seconds: float, begin: float, margin: float = WRONG) -> list[PoseEstimate]:
    return [
        estimate(begin + 0.1 * k, begin + 0.1 * k, lost=0.99, margin=margin if k % 10 == 9 else None)
        for k in range(round(10 * seconds))
    ]


def test_a_drive_that_fits_closely_is_localized() -> None:
    quality = judged(*straight_drive(10.0)).quality
    assert quality.verdict == LOCALIZED
    assert quality.known_share == 1.0
    assert quality.segments == quality.reasons == ()
    assert (
        quality.summary == "The drive is localized: the car's place was known on 100% of it, to some 0.03 m."
    )


def test_a_map_that_fits_roughly_everywhere_is_a_wrong_one_however_sure_the_filter_is() -> None:
    quality = judged(*straight_drive(10.0, margin=WRONG)).quality
    assert quality.verdict == LOST
    assert quality.known_share == 1.0
    assert "map of another place" in quality.summary


def test_a_long_drive_is_no_more_than_sure() -> None:
    odds = [judged(*straight_drive(seconds)).quality.map_log_odds for seconds in (50.0, 500.0)]
    assert odds[1] < 1.25 * odds[0]


@pytest.mark.parametrize("margin", [RIGHT, WRONG])
def test_what_a_car_sees_that_stands_leaves_the_map_in_doubt(margin: float) -> None:
    quality = judged(*straight_drive(60.0, speed=0.0, margin=margin)).quality
    assert quality.verdict == UNCERTAIN
    assert "drive farther" in quality.summary


@pytest.mark.parametrize(("metres", "verdict"), [(2.0, UNCERTAIN), (10.0, LOCALIZED)])
def test_so_does_a_short_way_from_where_a_search_chose_the_place(
    metres: float, verdict: DriveVerdict
) -> None:
    assert judged(*straight_drive(metres)).quality.verdict == verdict


def test_a_stretch_on_which_the_car_is_lost_is_named_with_its_time() -> None:
    drive = [*straight_drive(20.0), *lost_for(3.0, 20.0), *straight_drive(20.0, begin=23.0)]
    quality = judged(*drive).quality
    assert quality.verdict == LOCALIZED
    assert quality.known_share == pytest.approx(40.0 / 43.0, abs=0.01)
    (segment,) = quality.segments
    assert segment.seconds == pytest.approx((19.9, 22.9), abs=0.05)
    assert segment.is_lost
    assert "at 20 to 23 s near x 20.0 m, y 0.0 m" in quality.summary


@pytest.mark.parametrize(("seconds", "verdict"), [(1.0, LOCALIZED), (5.0, UNCERTAIN), (30.0, UNCERTAIN)])
def test_how_much_of_the_drive_is_known_decides(seconds: float, verdict: DriveVerdict) -> None:
    unsure = [estimate(20.0 + 0.1 * k, 20.0, weight=0.5) for k in range(round(10 * seconds))]
    assert judged(*straight_drive(20.0), *unsure).quality.verdict == verdict


@pytest.mark.parametrize(("seconds", "verdict"), [(3.0, UNCERTAIN), (12.0, LOST)])
def test_so_it_does_where_the_map_may_be_the_right_one(seconds: float, verdict: DriveVerdict) -> None:
    neither = -1.0
    drive = [*straight_drive(10.0, margin=neither), *lost_for(seconds, 10.0, neither)]
    quality = judged(*drive).quality
    assert quality.verdict == verdict
    assert any("no place on the map fitted" in sentence for sentence in quality.reasons) == (verdict == LOST)


def test_blinks_are_not_named_and_neighbours_are_one_segment() -> None:
    drive = list(straight_drive(20.0))
    for k in (50, 51, 80, 81, 82, 83, 84, 87, 88, 89, 90, 91):
        drive[k] = estimate(0.1 * k, 0.1 * k, deviation=2.0)
    (segment,) = judged(*drive).quality.segments
    assert segment.seconds == pytest.approx((7.9, 9.1), abs=0.05)
    assert not segment.is_lost


def test_of_many_segments_the_longest_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(unknown_segments, "_MOST", 2)
    drive = list(straight_drive(60.0))
    for n, begin in enumerate(range(0, 60, 10)):
        for k in range(10 * begin, 10 * begin + 10 + n):
            drive[k] = estimate(0.1 * k, 0.1 * k, weight=0.5)
    segments = judged(*drive).quality.segments
    assert [round(segment.seconds[0]) for segment in segments] == [40, 50]


def test_pauses_of_the_recording_are_no_part_of_the_drive() -> None:
    drive = [*straight_drive(10.0), estimate(500.0, 10.0, lost=0.9, is_start=True)]
    assert judged(*drive).quality.known_share > 0.9


def test_scans_that_repeat_a_pose_count_once_and_clocks_may_be_set_back() -> None:
    drive = list(straight_drive(10.0))
    again = [repeated for each in drive for repeated in (each, each)]
    assert judged(*again).quality.as_dict() == judged(*drive).quality.as_dict()
    back = judged(*drive, *(estimate(0.1 * k - 3600.0, 10.0 + 0.1 * k) for k in range(100)))
    assert back.quality.verdict == LOCALIZED
    assert back.path_metres == pytest.approx(19.9, abs=0.3)


def test_a_search_on_a_wrong_map_is_given_up() -> None:
    judge = judged(*lost_for(9.0, 0.0))
    assert not judge.is_hopeless
    for each in lost_for(3.0, 9.0):
        judge.follow(each)
    assert judge.is_hopeless


def test_a_car_that_is_lost_on_the_right_map_is_searched_for_on() -> None:
    assert not judged(*straight_drive(60.0), *lost_for(30.0, 60.0)).is_hopeless


def test_a_drive_that_is_nowhere_known_has_no_deviation() -> None:
    quality = judged(*lost_for(12.0, 0.0)).quality
    assert quality.verdict == LOST
    assert math.isnan(quality.deviation)
    assert "never known" in quality.summary


def test_before_any_scan_and_without_any_return_nothing_is_known() -> None:
    assert judged().quality.verdict == LOST
    blind = [estimate(0.1 * k, 0.1 * k, margin=None) for k in range(100)]
    assert judged(*blind).quality.verdict == UNCERTAIN


margins = st.floats(-100.0, 100.0)


def fit_of(drive: list[PoseEstimate]) -> MapFit:
    fit = MapFit()
    for each in drive:
        fit.follow(each)
    return fit


def driven(seen: list[float]) -> MapFit:
    """Two metres for each margin."""
    return fit_of(
        [estimate(2.0 * k, 2.0 * k, margin=margin, is_start=k == 0) for k, margin in enumerate(seen)]
    )


@given(st.lists(margins, min_size=1, max_size=50), st.integers(0, 49), st.floats(0.0, 50.0))
def test_a_larger_margin_never_speaks_against_the_map(seen: list[float], which: int, more: float) -> None:
    better = list(seen)
    better[which % len(seen)] += more
    assert driven(better).log_odds >= driven(seen).log_odds


@given(st.lists(margins, max_size=300))
def test_no_drive_is_more_than_sure(seen: list[float]) -> None:
    assert abs(driven(seen).log_odds) < 20.0


@pytest.mark.parametrize("margin", [RIGHT, WRONG])
@pytest.mark.parametrize("metres", [0.0, 1.0])
def test_a_car_that_stands_where_it_was_found_is_not_beyond_doubt(margin: float, metres: float) -> None:
    """However long; also if it has driven no farther than a metre before."""
    drive = list(straight_drive(metres, margin=margin))
    drive += [estimate(metres + k, metres, margin=margin, is_start=metres == k == 0) for k in range(100)]
    fit = fit_of(drive)
    assert not fit.is_right
    assert not fit.is_wrong


def metres(places: list[float], starts: frozenset[int] = frozenset()) -> float:
    steps = PoseSteps(0.1)
    return sum(steps.follow(estimate(0.1 * k, x, is_start=k in starts))[0] for k, x in enumerate(places))


def test_a_path_is_as_long_as_it_is() -> None:
    assert metres(np.linspace(0.0, 5.0, 701).tolist()) == pytest.approx(5.0, abs=0.1)


def test_jitter_of_a_car_that_stands_adds_nothing() -> None:
    assert metres(np.random.default_rng(0).normal(0.0, 0.02, 500).tolist()) == 0.0


def test_jumps_are_no_way() -> None:
    places = np.concatenate([np.linspace(0.0, 1.0, 21), np.linspace(30.0, 31.0, 21)])
    assert metres(places.tolist(), frozenset([0, 21])) == pytest.approx(2.0, abs=0.2)


def test_turns_on_the_spot_are_steps_where_they_are_wanted() -> None:
    steps = PoseSteps(0.1, 0.5)
    assert steps.follow(estimate(0.0, 0.0, yaw=3.0)) == (0.0, 0.0)
    assert steps.follow(estimate(0.1, 0.0, yaw=-3.1)) == (0.0, 0.0)
    assert steps.follow(estimate(0.2, 0.0, yaw=-2.7)) == pytest.approx((0.0, 2 * np.pi - 5.7))
