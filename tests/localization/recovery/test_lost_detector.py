from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.localization.floor.free_space import FreeSpace
from racecar.localization.recovery.agreement import agreement_of
from racecar.localization.recovery.lost_detector import LostDetector
from racecar.localization.recovery.place_search import PlaceSearch
from racecar.localization.sensor.beams import Beams
from racecar.maps.geometry.se2 import IDENTITY, Pose, compose
from racecar.maps.grid.ray_casting import cast_ray_fan
from tests.localization.floors import CONFIG, free_space_of, table_of
from tests.maps.drives import BASE_FROM_LASER, BEARINGS, pose_at, room

TRUE_PLACE = IDENTITY
WRONG_PLACES = [(0.0, 0.0, np.pi), (-2.5, 0.5, 2.5), (1.0, 0.0, 0.0), (0.0, 1.0, 0.3), (0.5, 0.5, 0.0)]
FRESH, SUREST = 0.5, 1.0 / (1.0 + np.exp(6.0))
RATES = pytest.mark.parametrize(("scans_per_second", "seconds"), [(40, 1.0), (5, 3.0)])
WRONG = pytest.mark.parametrize("wrong", WRONG_PLACES)


@cache
def free_space() -> FreeSpace:
    return free_space_of(room())


@cache
def shares_when_lost() -> np.ndarray:
    search = PlaceSearch(free_space(), table_of(free_space()), CONFIG.place_search)
    shares: np.ndarray = search.shares_when_lost(CONFIG.lost_detector)
    shares.flags.writeable = False
    return shares


def fresh() -> LostDetector:
    return LostDetector(shares_when_lost(), CONFIG.lost_detector)


def seen_at(seconds: float, people: float, rng: np.random.Generator) -> tuple[Pose, Beams]:
    """Where the car is, and its scan: a share of the beams is stopped by people side by side."""
    truth = pose_at(room(), np.array([seconds]), 1.5)[0]
    ranges = cast_ray_fan(room(), compose(truth, BASE_FROM_LASER)[None], BEARINGS, 30.0)[0]
    ranges += 0.01 * rng.standard_normal(len(ranges))
    count = round(people * len(ranges))
    first = int(rng.integers(len(ranges) - count))
    ranges[first : first + count] *= rng.uniform(0.3, 0.8)
    return truth, Beams(BEARINGS, ranges, BASE_FROM_LASER, 30.0).thinned(100)


def watch(
    detector: LostDetector,
    seconds: float,
    *,
    scans_per_second: int = 40,
    truth_from_pose: Pose | tuple[float, float, float] = TRUE_PLACE,
    people: float = 0.0,
    start: float = 0.0,
) -> np.ndarray:
    """(scans,) the probability of being lost after each scan of a drive, at a pose beside the truth."""
    rng, probabilities = np.random.default_rng(0), []
    for scan in range(round(seconds * scans_per_second)):
        truth, beams = seen_at(start + scan / scans_per_second, people, rng)
        agreement = agreement_of(compose(truth, truth_from_pose), beams, free_space(), CONFIG.lost_detector)
        if agreement is not None:
            detector.judge(agreement.shares, 1.0 / scans_per_second)
        probabilities.append(detector.probability)
    return np.array(probabilities)


@RATES
@pytest.mark.parametrize("start", [0.0, 5.0])
def test_at_the_right_place_it_soon_is_sure(scans_per_second: int, seconds: float, start: float) -> None:
    assert fresh().probability == FRESH
    probabilities = watch(fresh(), seconds, scans_per_second=scans_per_second, start=start)
    assert probabilities[-1] < 0.01


@RATES
@WRONG
def test_at_a_wrong_place_it_soon_is_lost(
    scans_per_second: int, seconds: float, wrong: tuple[float, float, float]
) -> None:
    probabilities = watch(fresh(), seconds, scans_per_second=scans_per_second, truth_from_pose=wrong)
    assert probabilities[-1] > 0.99


@RATES
@WRONG
def test_a_sure_one_changes_its_mind_as_soon(
    scans_per_second: int, seconds: float, wrong: tuple[float, float, float]
) -> None:
    detector = fresh()
    watch(detector, 5.0)
    assert detector.probability < 0.01
    assert watch(detector, seconds, scans_per_second=scans_per_second, truth_from_pose=wrong)[-1] > 0.95
    assert watch(detector, seconds, scans_per_second=scans_per_second)[-1] < 0.05


@pytest.mark.parametrize("people", [0.2, 0.4])
def test_people_alone_do_not_make_it_lost_once_it_knows_the_place(people: float) -> None:
    detector = fresh()
    watch(detector, 3.0)
    assert watch(detector, 8.0, people=people, start=3.0).max() < 0.1


@WRONG
def test_it_notices_a_wrong_place_among_people_too(wrong: tuple[float, float, float]) -> None:
    detector = fresh()
    watch(detector, 10.0, people=0.3)
    assert detector.probability < 0.05
    assert watch(detector, 2.0, truth_from_pose=wrong, people=0.3, start=10.0)[-1] > 0.9


def test_scans_count_less_where_it_learned_that_beams_disagree_anyway() -> None:
    quiet, crowded = fresh(), fresh()
    watch(quiet, 3.0)
    watch(crowded, 10.0, people=0.3)
    assert crowded.clarity < 0.5 * quiet.clarity
    assert 0.0 < crowded.clarity < quiet.clarity <= 1.0


def test_it_does_not_learn_from_a_place_that_is_in_doubt() -> None:
    detector = fresh()
    watch(detector, 5.0, truth_from_pose=(-2.5, 0.5, 2.5))
    assert detector.for_another_place().clarity == fresh().clarity


def test_a_car_that_starts_where_much_has_changed_is_not_lost() -> None:
    """A quarter of the beams look through what the map has, and some are stopped."""
    detector, probabilities = fresh(), []
    for _ in range(200):
        detector.judge(np.array([0.57, 0.03, 0.16, 0.24]), 0.025)
        probabilities.append(detector.probability)
    assert max(probabilities) <= 0.5
    assert probabilities[-1] < 0.01


def test_one_for_another_place_knows_the_sensor_but_not_the_place() -> None:
    detector = fresh()
    watch(detector, 10.0, people=0.3)
    other = detector.for_another_place()
    assert other.probability == FRESH
    assert other.clarity == detector.clarity
    before = detector.probability
    watch(other, 1.0, truth_from_pose=(-2.5, 0.5, 2.5), people=0.3)
    assert other.probability > 0.6
    assert detector.probability == before


shares = st.tuples(*[st.floats(0.0, 1.0)] * 4).filter(lambda parts: sum(parts) > 0.01)
scans = st.lists(st.tuples(shares, st.floats(0.0, 1e6)), min_size=1, max_size=60)


@settings(max_examples=60)
@given(scans)
def test_its_odds_are_bounded_whatever_it_sees(seen: list[tuple[tuple[float, ...], float]]) -> None:
    detector = fresh()
    for parts, seconds in seen:
        detector.judge(np.array(parts) / sum(parts), seconds)
        assert SUREST - 1e-9 <= detector.probability <= 1.0 - SUREST + 1e-9
        assert 0.0 < detector.clarity <= 1.0


@settings(max_examples=30)
@given(st.floats(0.25, 1e9))
def test_after_a_pause_a_scan_counts_no_more_than_a_quarter_of_a_second(seconds: float) -> None:
    probabilities = []
    for pause in (0.25, seconds):
        detector = fresh()
        detector.judge(np.array([0.4, 0.2, 0.2, 0.2]), pause)
        probabilities.append(detector.probability)
    assert probabilities[0] == probabilities[1] != FRESH


def test_a_thousand_scans_at_a_place_are_forgotten_as_soon_as_ten() -> None:
    short, long = fresh(), fresh()
    for detector, count in ((short, 10), (long, 1000)):
        for _ in range(count):
            detector.judge(np.array([0.0, 0.0, 0.5, 0.5]), 0.1)
        assert detector.probability == pytest.approx(1.0 - SUREST)
        detector.judge(np.array([1.0, 0.0, 0.0, 0.0]), 0.1)
    assert long.probability == short.probability < 0.995
