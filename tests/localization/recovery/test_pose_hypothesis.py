from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.localization.config import LocalizationConfig
from racecar.localization.filter.particle_filter import ParticleFilter
from racecar.localization.recovery.hypotheses import CONFIRMED_BELOW
from racecar.localization.recovery.perception import Perception
from racecar.localization.recovery.place_judge import PlaceJudge
from racecar.localization.recovery.pose_hypothesis import PoseHypothesis
from racecar.localization.sensor.end_points import EndPoints
from racecar.maps.geometry.se2 import IDENTITY, Pose, compose
from racecar.maps.map_files import load_map
from racecar.maps.shipped import shipped_map
from tests.localization.scenes import points_at, points_from, ranges_from, slanted_corridor
from tests.sensors.drives import pose_at, room

SECOND = 1_000_000_000
WRONG_PLACE = np.array([-2.5, 0.5, 2.5])
STANDING = compose(room().map_from_grid, [9.0, 4.0, 0.7])
GOOD, BAD = 0.85, 0.2


def hypothesis_of(judge: PlaceJudge, pose: Pose = IDENTITY, stamp: int = 0) -> PoseHypothesis:
    return PoseHypothesis(ParticleFilter(np.tile(pose, (10, 1)), np.random.default_rng(0)), judge, stamp)


def is_confirmed(hypothesis: PoseHypothesis) -> bool:
    return hypothesis.judge.probability_lost < CONFIRMED_BELOW


def judged(fit: float) -> PlaceJudge:
    """One that has seen five seconds of the like."""
    judge = PlaceJudge()
    for _ in range(50):
        judge.judge(fit, 0.1)
    return judge


@cache
def perception_in(name: str) -> Perception:
    grids = {"room": room, "corridor": lambda: slanted_corridor(0.0, 0.05)}
    return Perception(grids[name]() if name in grids else load_map(shipped_map(name)))


def driven(truth_from_place: Pose, seconds: float) -> PoseHypothesis:
    """A hypothesis after scans at 40 Hz of a drive, of a place beside the car's or where it is."""
    hypothesis = hypothesis_of(PlaceJudge())
    for scan in range(round(seconds * 40)):
        truth = pose_at(room(), np.array([scan / 40]), 1.5)[0]
        fit = perception_in("room").fit(
            compose(truth, truth_from_place), points_from(room(), truth).thinned(100)
        )
        assert fit is not None
        hypothesis.judge.judge(fit, 1 / 40)
    return hypothesis


def test_a_hypothesis_at_the_true_place_is_confirmed_within_a_second() -> None:
    assert is_confirmed(driven(IDENTITY, 1.0))


@pytest.mark.parametrize("seconds", [0.5, 2.0])
@pytest.mark.parametrize("place", [WRONG_PLACE, np.array([0.0, 0.0, np.pi])])
def test_a_hypothesis_at_a_wrong_place_is_not(place: Pose, seconds: float) -> None:
    hypothesis = driven(place, seconds)
    assert not is_confirmed(hypothesis)
    assert hypothesis.has_failed(2 * SECOND)


@pytest.mark.parametrize(("fit", "fails"), [(BAD, True), (GOOD, False)])
def test_it_fails_only_after_its_trial(fit: float, fails: bool) -> None:
    found = 5 * SECOND
    hypothesis = hypothesis_of(judged(fit), stamp=found)
    assert is_confirmed(hypothesis) != fails
    assert not hypothesis.has_failed(found)
    assert not hypothesis.has_failed(found + SECOND - 1)
    assert hypothesis.has_failed(found + SECOND) == fails
    assert hypothesis.has_failed(found + 60 * SECOND) == fails


def distance_after(seconds: float, aside: Pose, points: EndPoints) -> float:
    """Metres from a standing car to a narrow cloud that began aside of it, by 20 scans a second."""
    rng, noise = np.random.default_rng(0), np.array([0.04, 0.04, 0.01])
    cloud = compose(STANDING, aside) + noise * rng.standard_normal((LocalizationConfig().fewest_particles, 3))
    particles = ParticleFilter(cloud, rng)
    hypothesis, perception = PoseHypothesis(particles, PlaceJudge(), 0), Perception(room())
    for scan in range(round(20 * seconds)):
        hypothesis.estimate(points, scan * SECOND // 20, 1 / 20, False, perception)
        assert hypothesis.is_known
        hypothesis.weigh(points, 0.1, perception)
        hypothesis.resample(LocalizationConfig())
    return float(np.hypot(*(hypothesis.particles.moments()[0] - STANDING)[:2]))


@pytest.mark.parametrize("aside", [(0.2, 0.0, 0.0), (0.3, 0.0, 0.0), (0.4, 0.0, 0.0)])
def test_a_narrow_cloud_beside_the_place_comes_back_by_proposals(
    aside: tuple[float, float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert distance_after(1.0, np.array(aside), points_from(room(), STANDING).thinned(100)) < 0.04
    monkeypatch.setattr(ParticleFilter, "propose", lambda *_: None)
    assert distance_after(1.0, np.array(aside), points_from(room(), STANDING).thinned(100)) > 0.15


@pytest.mark.parametrize("moved", [60, 90])
def test_a_cloud_is_not_drawn_aside_by_what_stands_before_walls(
    moved: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Twenty centimetres before them, over a quarter or a third of the scan."""
    ranges = ranges_from(room(), STANDING)
    ranges[90 : 90 + moved] *= 0.93
    points = points_at(ranges).thinned(100)
    assert distance_after(1.0, IDENTITY, points) < 0.03
    monkeypatch.setattr(Perception, "explained", lambda *arguments: arguments[-1])
    assert distance_after(1.0, IDENTITY, points) > 0.1


@settings(max_examples=20, deadline=None)
@given(st.sampled_from(["building", "track", "corridor"]), st.integers(0, 1000))
def test_the_more_beams_fit_the_less_probably_the_car_is_lost(name: str, seed: int) -> None:
    """Wherever it is, and along a bare corridor, too; with none that fits, it is laid on other walls."""
    perception, rng = perception_in(name), np.random.default_rng(seed)
    pose = compose(np.zeros(3), [0.0, 0.0, 0.2])
    if name != "corridor":
        pose = perception.free_space.draw_poses(1, rng)[0]
    points = points_from(perception.walls.grid, pose).thinned(100)
    order, nearer = rng.permutation(len(points)), rng.uniform(0.2, 0.8, (len(points), 1))
    stopped = points.laser + nearer * (points.in_base - points.laser)
    lost = []
    for share in np.linspace(0.25, 1.0, 4):
        chosen, ends = order[: round((1.0 - share) * len(points))], points.in_base.copy()
        ends[chosen] = stopped[chosen]
        hypothesis, estimate = hypothesis_of(PlaceJudge(), pose), None
        spoiled = EndPoints(ends, points.laser)
        for scan in range(5):
            estimate = hypothesis.estimate(spoiled, scan * SECOND // 10, 0.1, False, perception)
        assert estimate is not None
        lost.append(estimate.lost_probability)
    assert np.all(np.diff(lost) <= 0.02), lost
