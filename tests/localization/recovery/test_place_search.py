from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.localization.config import LocalizationConfig
from racecar.localization.floor.free_space import Region
from racecar.localization.recovery.perception import Perception
from racecar.localization.recovery.place_search import best_places, score_places, turned_points
from racecar.localization.sensor.end_points import EndPoints
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose
from tests.localization.scenes import points_at, ranges_from
from tests.sensors.drives import BASE_FROM_LASER, room

PLACES = [(9.0, 2.0, 0.0), (3.0, 3.0, 1.0), (7.5, 6.0, -2.0), (1.5, 6.5, 3.0)]


@cache
def perception() -> Perception:
    return Perception(room())


def found(points: EndPoints, count: int = LocalizationConfig().scattered_particles) -> Pose:
    return perception().places.find(points, count, np.random.default_rng(0))


def seen_from(pose: Pose, base_from_laser: Pose = BASE_FROM_LASER, people: float = 0.0) -> EndPoints:
    rng = np.random.default_rng(0)
    ranges = ranges_from(room(), pose, base_from_laser)
    ranges += 0.01 * rng.standard_normal(len(ranges))
    ranges[: round(people * len(ranges))] *= 0.5
    return points_at(ranges, base_from_laser)


def is_near(poses: Pose, truth: Pose) -> np.ndarray:
    off = np.abs(between(truth, poses))
    return np.asarray((np.hypot(off[:, 0], off[:, 1]) < 0.4) & (off[:, 2] < 0.2))


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("people", [0.0, 0.2])
def test_the_place_is_found(place: tuple[float, float, float], people: float) -> None:
    truth = compose(room().map_from_grid, place)
    points = seen_from(truth, people=people)
    poses = found(points)
    assert poses.shape == (LocalizationConfig().scattered_particles, 3)
    is_right, log_likelihood = is_near(poses, truth), perception().log_likelihood(poses, points)
    assert is_right.mean() > 0.05
    # Of the two corners that are alike, what stands in one is not seen by end points that lie behind it.
    is_one_of_two = place == PLACES[3]
    assert log_likelihood[is_right].max() > log_likelihood[~is_right].max() - 2.0 * is_one_of_two


def test_the_headings_that_are_found_lean_to_no_side() -> None:
    """Over places that lie anyhow between those that are tried."""
    rng, offs = np.random.default_rng(0), []
    for yaw in np.linspace(-np.pi, np.pi, 120, endpoint=False):
        truth = compose(room().map_from_grid, (*rng.uniform([2.5, 2.5], [4.5, 5.5]), yaw))
        poses = found(seen_from(truth, IDENTITY), 300)
        offs.append(np.median(between(truth, poses[is_near(poses, truth)])[:, 2]))
    assert abs(np.mean(offs)) < np.radians(0.3)


def test_what_is_found_is_the_base_wherever_the_laser_is_on_it() -> None:
    truth = compose(room().map_from_grid, PLACES[0])
    poses = found(seen_from(truth, np.array([-0.4, 0.2, 2.0])))
    assert is_near(poses, truth).mean() > 0.05


@pytest.mark.parametrize("radius", [0.5, 2.0])
@pytest.mark.parametrize("place", PLACES)
def test_only_a_region_is_searched_whatever_fits_elsewhere(
    place: tuple[float, float, float], radius: float
) -> None:
    truth = compose(room().map_from_grid, PLACES[0])
    region = Region(compose(room().map_from_grid, place)[:2], radius)
    points = seen_from(truth, IDENTITY)
    poses = perception().places.find(points, 500, np.random.default_rng(0), region)
    assert poses.shape == (500, 3)
    assert np.hypot(*(poses[:, :2] - region.center).T).max() < radius + 0.5
    assert is_near(poses, truth).any() == (place == PLACES[0])


@settings(max_examples=20, deadline=None)
@given(st.floats(-1e9, 1e9), st.floats(-1e9, 1e9))
def test_a_point_far_off_the_map_fits_nowhere(x: float, y: float) -> None:
    points = seen_from(compose(room().map_from_grid, PLACES[0])).thinned(14)
    far = [[x, y + np.copysign(50.0, y)]]
    with_far = EndPoints(np.concatenate([points.in_base, far]), points.laser)
    best = [
        perception().places.best_elsewhere(slice(None), seen, np.zeros(2), 0.0, 1)
        for seen in (points, with_far)
    ]
    np.testing.assert_array_equal(*best)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10_000), st.integers(0, 30), st.integers(1, 3))
def test_the_best_places_are_those_of_the_highest_sums(seed: int, places: int, most: int) -> None:
    rng = np.random.default_rng(seed)
    codes = rng.integers(0, 20, (30, 40)).astype(np.uint8)
    log_by_code = -rng.uniform(0.0, 2.0, 256).astype(np.float32)
    pixels = rng.integers(0, 30, (places, 2)).astype(np.int32)
    turned = turned_points(rng.uniform(-9.0, 9.0, (5, 2)), 8, 100)
    scores = np.empty((places, 8), dtype=np.float32)
    score_places(pixels, turned, codes, log_by_code, scores)
    place, turn = best_places(pixels, turned, codes, log_by_code, most)
    best = np.sort(scores.max(axis=1, initial=-np.inf))[::-1][:most]
    np.testing.assert_array_equal(scores[place, turn], best)
    assert len(set(place.tolist())) == len(place)
