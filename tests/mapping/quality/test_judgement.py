"""The verdict on whole maps: a drive round a room, and what its map is worth when it was made wrong."""

from functools import cache

import numpy as np
import pytest

from racecar.mapping.config import MappingConfig
from racecar.mapping.graph.constraint import ConstraintList
from racecar.mapping.mapper import Mapper
from racecar.mapping.quality import statistics
from racecar.mapping.quality.config import QualityConfig
from racecar.mapping.quality.finished_map import FinishedMap
from racecar.mapping.quality.judgement import judge
from racecar.mapping.quality.map_quality import MapQuality, Verdict
from racecar.mapping.session.session import Session
from racecar.mapping.state.result import MappingResult
from racecar.maps.geometry.se2 import IDENTITY, Pose, compose, inverse
from racecar.sensors.matching.scan_store import ScanStore
from racecar.sensors.scan import Scan
from tests.mapping.mapped import mapped as mapped_from
from tests.mapping.mapped import scans_of
from tests.sensors.drives import drive, room

MESSAGES = drive(room(), 26.0, np.random.default_rng(1)).messages


@cache
def mapped() -> MappingResult:
    return mapped_from(MESSAGES)


@cache
def bent(radians_per_keyframe: float) -> MapQuality:
    """The verdict on the same map with its path bent."""
    session = mapped().session
    straight = session.map_from_keyframe
    steps = np.diff(straight, axis=0)
    turned = np.array(straight[:1])
    for k in range(len(steps)):
        step = compose(inverse(straight[k]), straight[k + 1]) + np.array([0.0, 0.0, radians_per_keyframe])
        turned = np.concatenate([turned, compose(turned[-1], step)[None]])
    session.map_from_keyframe = turned
    try:
        return judge(FinishedMap(session), QualityConfig())
    finally:
        session.map_from_keyframe = straight


def test_a_clean_drive_gives_a_good_map() -> None:
    quality = mapped().quality
    assert quality.verdict == Verdict.GOOD
    assert quality.error_per_10_m < 0.05
    assert not quality.reasons


def test_a_map_is_judged_as_it_was_while_the_mapper_goes_on() -> None:
    mapper = Mapper(MappingConfig())
    verdicts = []
    for number, message in enumerate(MESSAGES):
        if isinstance(message, Scan):
            mapper.add_scan(message)
            if number > len(MESSAGES) // 2 and not verdicts:
                verdicts = [mapper.quality_so_far()]
                at_once = verdicts[0]()
        else:
            mapper.add_odometry(message)
    later = verdicts[0]()
    np.testing.assert_equal(later.statistics, at_once.statistics)
    assert later.verdict == Verdict.GOOD
    assert mapper.quality_so_far()().statistics["path_m"] > later.statistics["path_m"]


def test_a_bent_map_is_wrong_and_passes_are_named_that_contradict_each_other() -> None:
    quality = bent(0.01)
    assert quality.verdict == Verdict.WRONG
    assert quality.error_per_10_m > 10.0 * mapped().quality.error_per_10_m
    assert any(segment.contradicted_by is not None for segment in quality.segments)
    assert quality.reasons
    assert "wrong" in quality.summary
    assert "contradict each other" in quality.summary
    assert not any(reason.startswith("Passes through the same place") for reason in quality.reasons)


@pytest.mark.parametrize("bends", [(0.0, 0.002), (0.002, 0.005), (0.005, 0.01)])
def test_the_more_it_is_bent_the_larger_the_error_that_is_expected(bends: tuple[float, float]) -> None:
    less, more = (bent(each) for each in bends)
    assert more.error_per_10_m > less.error_per_10_m


def test_wheels_that_slip_where_walls_hold_are_held_against_the_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(statistics, "slip_share", lambda *_: 500.0)
    session = mapped().session
    quality = judge(FinishedMap(session), QualityConfig())
    assert quality.error_per_10_m == quality.statistics["slip_per_10_m"]
    assert quality.verdict == Verdict.WRONG
    assert quality.reasons[0].startswith("Where walls hold, wheels and map differ by")


def test_a_car_that_stood_all_the_time_has_a_good_map() -> None:
    quality = mapped_from(scans_of(MESSAGES)[:1]).quality
    assert quality.verdict == Verdict.GOOD
    assert not quality.segments


def test_wheels_that_never_count_leave_a_map_doubtful() -> None:
    session = mapped_from(scans_of(MESSAGES)).session
    for overruled, verdict in ((0.0, Verdict.GOOD), (1.0, Verdict.DOUBTFUL)):
        quality = judge(FinishedMap(session, overruled_wheels=overruled), QualityConfig())
        assert quality.verdict == verdict
        assert ("contradict each other" in quality.summary) == (verdict == Verdict.DOUBTFUL)


@pytest.mark.parametrize("scale", [0.0, 0.5, 2.0])
def test_lengths_by_scans_and_by_wheels_that_differ_are_told(scale: float) -> None:
    session = mapped().session
    quality = judge(FinishedMap(session, scale), QualityConfig())
    assert quality.verdict == Verdict.DOUBTFUL
    assert f"{scale:.2f} times" in quality.summary


def twice(later_from_earlier: Pose) -> MapQuality:
    """The verdict on two drives of the same room, of which the later one lies elsewhere."""
    session, second = mapped().session, mapped().session.map_from_keyframe
    count = len(second)
    keyframes = ScanStore(2 * count)
    keyframes.extend(session.keyframes)
    keyframes.extend(session.keyframes)
    arrays = session.constraints.to_arrays()
    moved = {name: np.concatenate([rows, rows]) for name, rows in arrays.items()}
    moved["keyframes"] = np.concatenate([arrays["keyframes"], arrays["keyframes"] + count])
    joint = Session(
        keyframes,
        [*session.rays, *session.rays],
        np.tile(session.keyframe_from_base, (2, 1)),
        np.concatenate([second, compose(later_from_earlier, second)]),
        ConstraintList.from_arrays(moved),
        session.loops.followed_by(session.loops),
        session.times.followed_by(session.times, is_newer=True),
    )
    return judge(FinishedMap(joint), QualityConfig())


def test_of_a_map_that_is_carried_on_the_last_drive_is_judged() -> None:
    quality = twice(IDENTITY)
    assert quality.verdict == Verdict.GOOD
    assert quality.error_per_10_m == pytest.approx(mapped().quality.error_per_10_m, abs=0.02)
    assert quality.statistics["unlike_earlier"] < 0.1


def test_a_drive_that_was_joined_at_a_wrong_place_is_doubtful() -> None:
    quality = twice(np.array([0.6, 0.4, 0.1]))
    assert quality.verdict == Verdict.DOUBTFUL
    assert quality.statistics["unlike_earlier"] > 0.3
    assert "joined at a wrong place" in quality.reasons[0]
