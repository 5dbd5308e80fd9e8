import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.localization.filter.particle_filter import ParticleFilter
from racecar.localization.recovery.hypothesis import PoseHypothesis
from racecar.localization.recovery.lost_detector import LostDetector, agreement_shares
from racecar.localization.recovery.place_search import PlaceSearch
from racecar.localization.sensor.beam_model import BeamModel
from racecar.localization.sensor.beams import Beams
from racecar.maps.geometry.se2 import IDENTITY, Pose, compose
from racecar.maps.grid.ray_casting import cast_ray_fan
from tests.localization.floors import CONFIG, free_space_of, table_of
from tests.maps.drives import BASE_FROM_LASER, BEARINGS, pose_at, room

SECOND = 1_000_000_000
LOST = CONFIG.lost_detector
WRONG_PLACE = (-2.5, 0.5, 2.5)
GOOD, BAD = np.array([0.9, 0.08, 0.01, 0.01]), np.array([0.1, 0.1, 0.4, 0.4])
WHEN_LOST = np.tile([0.1, 0.15, 0.4, 0.35], (12, 1))


def cloud() -> ParticleFilter:
    return ParticleFilter(np.zeros((10, 3)), np.random.default_rng(0))


def hypothesis_of(lost: LostDetector, stamp: int = 0) -> PoseHypothesis:
    return PoseHypothesis(cloud(), lost, stamp, CONFIG.hypothesis)


def judged(shares: np.ndarray) -> LostDetector:
    """A detector that has seen five seconds of the like."""
    detector = LostDetector(WHEN_LOST, LOST)
    for _ in range(50):
        detector.judge(shares, 0.1)
    return detector


def race(truth_from_first: Pose, truth_from_second: Pose, seconds: float, is_moving: bool) -> PoseHypothesis:
    """A hypothesis after scans at 40 Hz of a drive, of two places of which one or none is the car's."""
    free_space = free_space_of(room())
    table = table_of(free_space)
    model, rng = BeamModel(free_space, table, CONFIG.beam_model, 2.2), np.random.default_rng(0)
    shares_when_lost = PlaceSearch(free_space, table, CONFIG.place_search).shares_when_lost(LOST)
    hypothesis = hypothesis_of(LostDetector(shares_when_lost, LOST))
    for scan in range(round(seconds * 40)):
        truth = pose_at(room(), np.array([scan / 40]), 1.5)[0]
        ranges = cast_ray_fan(room(), compose(truth, BASE_FROM_LASER)[None], BEARINGS, 30.0)[0]
        beams = Beams(BEARINGS, ranges, BASE_FROM_LASER, 30.0).thinned(100)
        places = compose(truth, np.array([truth_from_first, truth_from_second]))
        shares = agreement_shares(places[1], beams, free_space, LOST)
        if shares is not None:
            hypothesis.lost.judge(shares, 1 / 40)
        first, second = model.log_likelihood(places + 0.01 * rng.standard_normal((2, 3)), beams)
        hypothesis.compare(float(second - first), 1 / 40, is_moving)
    return hypothesis


def test_a_hypothesis_at_the_true_place_wins() -> None:
    assert race(np.array(WRONG_PLACE), IDENTITY, 2.0, True).has_won


@pytest.mark.parametrize("first", [IDENTITY, np.array([0.0, 0.0, np.pi])])
def test_a_hypothesis_at_a_wrong_place_does_not_win(first: Pose) -> None:
    hypothesis = race(first, np.array(WRONG_PLACE), 2.0, True)
    assert not hypothesis.has_won
    assert hypothesis.has_failed(2 * SECOND)


def test_a_hypothesis_that_is_no_better_does_not_win() -> None:
    hypothesis = race(IDENTITY, IDENTITY, 2.0, True)
    assert hypothesis.lost.probability < 0.02
    assert not hypothesis.has_won
    assert not hypothesis.has_failed(2 * SECOND)


def test_scans_of_a_car_that_stands_hardly_count() -> None:
    moving, standing = (hypothesis_of(judged(GOOD)) for _ in range(2))
    scans_until = []
    for hypothesis, is_moving in ((moving, True), (standing, False)):
        scans = 0
        while not hypothesis.has_won:
            hypothesis.compare(40.0, 0.05, is_moving)
            scans += 1
        scans_until.append(scans)
    assert scans_until[1] == pytest.approx(10 * scans_until[0], rel=0.05)


def test_a_better_fit_wins_at_a_good_place_only() -> None:
    for shares, has_won in ((GOOD, True), (BAD, False)):
        hypothesis = hypothesis_of(judged(shares))
        for _ in range(100):
            hypothesis.compare(50.0, 0.1, True)
        assert hypothesis.has_won == has_won


@settings(max_examples=60)
@given(st.floats(0.0, 1e9), st.floats(0.0, 1e9))
def test_no_single_scan_decides(advantage: float, seconds: float) -> None:
    hypothesis = hypothesis_of(judged(GOOD))
    hypothesis.compare(advantage, seconds, True)
    assert not hypothesis.has_won


@settings(max_examples=60)
@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=20))
def test_what_speaks_against_it_counts_as_much_as_what_speaks_for_it(advantages: list[float]) -> None:
    hypothesis = hypothesis_of(judged(GOOD))
    for advantage in [*advantages, *(-advantage for advantage in advantages)] * 20:
        hypothesis.compare(advantage, 0.05, True)
    assert not hypothesis.has_won
    for _ in range(40):
        hypothesis.compare(60.0, 0.1, True)
    assert hypothesis.has_won


@pytest.mark.parametrize(("shares", "fails"), [(BAD, True), (GOOD, False)])
def test_it_fails_only_after_its_trial(shares: np.ndarray, fails: bool) -> None:
    found = 5 * SECOND
    hypothesis = hypothesis_of(judged(shares), found)
    assert not hypothesis.has_failed(found)
    assert not hypothesis.has_failed(found + SECOND - 1)
    assert hypothesis.has_failed(found + SECOND) == fails
    assert hypothesis.has_failed(found + 60 * SECOND) == fails
