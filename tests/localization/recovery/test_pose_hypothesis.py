import numpy as np
import pytest

from racecar.localization.filter.particle_filter import ParticleFilter
from racecar.localization.recovery.agreement import agreement_of
from racecar.localization.recovery.lost_detector import LostDetector
from racecar.localization.recovery.place_search import PlaceSearch
from racecar.localization.recovery.pose_hypothesis import PoseHypothesis
from racecar.localization.sensor.beams import Beams
from racecar.maps.geometry.se2 import IDENTITY, Pose, compose
from racecar.maps.grid.ray_casting import cast_ray_fan
from tests.localization.floors import CONFIG, free_space_of, table_of
from tests.maps.drives import BASE_FROM_LASER, BEARINGS, pose_at, room

SECOND = 1_000_000_000
LOST, RULES = CONFIG.lost_detector, CONFIG.hypothesis
WRONG_PLACE = np.array([-2.5, 0.5, 2.5])
GOOD, BAD = np.array([0.9, 0.08, 0.01, 0.01]), np.array([0.1, 0.1, 0.4, 0.4])
WHEN_LOST = np.tile([0.1, 0.15, 0.4, 0.35], (12, 1))


def hypothesis_of(lost: LostDetector, stamp: int = 0) -> PoseHypothesis:
    return PoseHypothesis(ParticleFilter(np.zeros((10, 3)), np.random.default_rng(0)), lost, stamp)


def is_confirmed(hypothesis: PoseHypothesis) -> bool:
    return hypothesis.lost.probability < RULES.confirmed_below


def judged(shares: np.ndarray) -> LostDetector:
    """A detector that has seen five seconds of the like."""
    detector = LostDetector(WHEN_LOST, LOST)
    for _ in range(50):
        detector.judge(shares, 0.1)
    return detector


def driven(truth_from_place: Pose, seconds: float) -> PoseHypothesis:
    """A hypothesis after scans at 40 Hz of a drive, of a place beside the car's or where it is."""
    free_space = free_space_of(room())
    search = PlaceSearch(free_space, table_of(free_space), CONFIG.place_search)
    hypothesis = hypothesis_of(LostDetector(search.shares_when_lost(LOST), LOST))
    for scan in range(round(seconds * 40)):
        truth = pose_at(room(), np.array([scan / 40]), 1.5)[0]
        ranges = cast_ray_fan(room(), compose(truth, BASE_FROM_LASER)[None], BEARINGS, 30.0)[0]
        beams = Beams(BEARINGS, ranges, BASE_FROM_LASER, 30.0).thinned(100)
        agreement = agreement_of(compose(truth, truth_from_place), beams, free_space, LOST)
        if agreement is not None:
            hypothesis.lost.judge(agreement.shares, 1 / 40)
    return hypothesis


def test_a_hypothesis_at_the_true_place_is_confirmed_within_half_a_second() -> None:
    assert is_confirmed(driven(IDENTITY, 0.5))


@pytest.mark.parametrize("seconds", [0.5, 2.0])
@pytest.mark.parametrize("place", [WRONG_PLACE, np.array([0.0, 0.0, np.pi])])
def test_a_hypothesis_at_a_wrong_place_is_not(place: Pose, seconds: float) -> None:
    hypothesis = driven(place, seconds)
    assert not is_confirmed(hypothesis)
    assert hypothesis.has_failed(2 * SECOND, RULES.trial_seconds)


@pytest.mark.parametrize("shares", [GOOD, BAD])
def test_no_single_scan_decides(shares: np.ndarray) -> None:
    hypothesis = hypothesis_of(LostDetector(WHEN_LOST, LOST))
    hypothesis.lost.judge(shares, 1 / 40)
    assert not is_confirmed(hypothesis)


def test_a_good_place_is_confirmed_and_a_bad_one_is_not() -> None:
    assert is_confirmed(hypothesis_of(judged(GOOD)))
    assert not is_confirmed(hypothesis_of(judged(BAD)))


@pytest.mark.parametrize(("shares", "fails"), [(BAD, True), (GOOD, False)])
def test_it_fails_only_after_its_trial(shares: np.ndarray, fails: bool) -> None:
    found = 5 * SECOND
    hypothesis = hypothesis_of(judged(shares), found)
    assert not hypothesis.has_failed(found, RULES.trial_seconds)
    assert not hypothesis.has_failed(found + SECOND - 1, RULES.trial_seconds)
    assert hypothesis.has_failed(found + SECOND, RULES.trial_seconds) == fails
    assert hypothesis.has_failed(found + 60 * SECOND, RULES.trial_seconds) == fails
