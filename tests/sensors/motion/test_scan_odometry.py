"""Scan odometry of planar scans and of clouds, the turns that it searches for, and the walls that it sees."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose
from racecar.sensors.motion.scan_odometry import ScanOdometry
from racecar.sensors.motion.turn_search import with_turn_seen
from racecar.sensors.motion.upright import upright_points
from tests.sensors.worlds import CORRIDOR, ROOM, box, points_at, ranges

WALLS = box(-6.0, -3.0, 9.0, 4.0)
HEIGHT, CEILING = 0.4, 2.5
STEP = np.array([0.08, 0.0, 0.01])
BEARINGS = np.radians(np.arange(-179.8, 180.0, 0.5))
AROUND = np.column_stack([np.cos(BEARINGS), np.sin(BEARINGS)])


def planar_scan(pose: Pose) -> np.ndarray:
    return ranges(WALLS, pose, BEARINGS)[:, None] * AROUND


def cloud(pose: Pose) -> np.ndarray:
    """Of 16 rows; as many points on floor and ceiling as on the walls. Heights above the floor."""
    up = np.tan(np.radians(np.arange(-15.0, 16.0, 2.0)))
    to_plates = np.where(up < 0, -HEIGHT / up, (CEILING - HEIGHT) / up)
    across = np.minimum(ranges(WALLS, pose, BEARINGS)[:, None], to_plates)
    across += 0.01 * np.random.default_rng(int(1e4 * pose[0])).standard_normal(across.shape)
    x, y = across * AROUND[:, :1], across * AROUND[:, 1:]
    return np.stack([x, y, HEIGHT + across * up], axis=-1).reshape(-1, 3)


@pytest.mark.parametrize("see", [planar_scan, cloud])
@pytest.mark.parametrize("is_predicted", [True, False])
def test_path_is_found(see, is_predicted: bool) -> None:
    odometry = ScanOdometry()
    poses, found = [np.zeros(3)], [odometry.register(see(np.zeros(3)), IDENTITY)]
    for _ in range(30):
        poses.append(compose(poses[-1], STEP))
        last = between(found[-2], found[-1]) if len(found) > 1 else IDENTITY
        found.append(odometry.register(see(poses[-1]), STEP if is_predicted else last))
    error = np.array(found) - np.array(poses)
    assert np.hypot(error[:, 0], error[:, 1]).max() < 0.05
    assert np.abs(error[:, 2]).max() < np.radians(0.5)


@pytest.mark.parametrize("columns", [2, 3])
def test_without_points_the_prediction_stands(columns: int) -> None:
    odometry = ScanOdometry()
    odometry.register(np.empty((0, columns)), STEP)
    np.testing.assert_allclose(odometry.register(np.empty((0, columns)), IDENTITY), STEP, atol=1e-12)


def test_a_tilted_car_reports_its_motion_in_its_own_plane() -> None:
    """Ramps and bumps tilt the sensor against the local map, not the motion that is reported."""
    tilt = np.radians(4.0)
    rotation = np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0], [-np.sin(tilt), 0, np.cos(tilt)]])
    odometry = ScanOdometry()
    odometry.register(cloud(np.zeros(3)), IDENTITY)
    tilted = (cloud(np.zeros(3)) - [0, 0, HEIGHT]) @ rotation + [0, 0, HEIGHT]
    np.testing.assert_allclose(odometry.register(tilted, IDENTITY), np.zeros(3), atol=0.05)


START = np.array([-1.0, 0.5, 0.3])


@settings(max_examples=20)
@given(st.floats(-0.48, 0.48), st.floats(-0.2, 0.2))
def test_a_turn_that_was_not_predicted_is_found(turn: float, forward: float) -> None:
    moved = np.array([forward, 0.0, turn])
    found = with_turn_seen(points_at(ROOM, START), points_at(ROOM, compose(START, moved)), IDENTITY)
    assert abs(found[2] - turn) < 0.06
    np.testing.assert_array_equal(found[:2], IDENTITY[:2])


@settings(max_examples=20)
@given(st.floats(-0.3, 0.3), st.floats(-0.5, 0.5))
def test_a_motion_that_was_predicted_rightly_stays_as_it_is(turn: float, forward: float) -> None:
    motion = np.array([forward, 0.0, turn])
    found = with_turn_seen(points_at(ROOM, START), points_at(ROOM, compose(START, motion)), motion)
    np.testing.assert_array_equal(found, motion)


@settings(max_examples=20)
@given(st.floats(0.0, 1.0))
def test_along_a_bare_corridor_the_prediction_stays(forward: float) -> None:
    start, motion = np.zeros(3), np.array([forward, 0.0, 0.0])
    found = with_turn_seen(points_at(CORRIDOR, start), points_at(CORRIDOR, compose(start, motion)), motion)
    np.testing.assert_array_equal(found, motion)


def test_a_scan_that_saw_nothing_turns_nothing() -> None:
    motion = np.array([0.3, 0.0, 0.1])
    np.testing.assert_array_equal(with_turn_seen(np.zeros((0, 2)), points_at(ROOM, START), motion), motion)
    np.testing.assert_array_equal(with_turn_seen(points_at(ROOM, START), np.zeros((0, 2)), motion), motion)


GENERATOR_SEED = 5


def plate(height: float) -> np.ndarray:
    """(N, 3) a floor or ceiling with the noise of a sensor."""
    generator = np.random.default_rng(GENERATOR_SEED)
    points = generator.uniform(-10.0, 10.0, (4000, 3))
    points[:, 2] = height + 0.02 * generator.standard_normal(len(points))
    return points


def wall(rows: int) -> np.ndarray:
    """(N, 3) at x = 12, 2.4 m high."""
    y, z = np.meshgrid(np.arange(-10.0, 10.0, 0.1), np.linspace(0.0, 2.4, rows))
    return np.column_stack([np.full(y.size, 12.0), y.ravel(), z.ravel()])


def test_floor_and_ceiling_go_and_the_wall_stays() -> None:
    kept = upright_points(np.concatenate([plate(0.0), wall(rows=9), plate(2.4)]))
    assert (kept[:, 0] == 12.0).all()
    assert len(kept) == 7 * 200  # all rows but the lowest, where a floor may meet it, and the highest


def test_floor_at_the_foot_of_the_wall_goes() -> None:
    foot = plate(0.0) + np.array([12.0 - 9.9, 0.0, 0.0])
    kept = upright_points(np.concatenate([foot, wall(rows=9)]))
    assert (kept[:, 2] > 0.1).all()
    assert len(kept) == 7 * 200


def test_nothing_comes_of_nothing() -> None:
    assert upright_points(np.empty((0, 3))).shape == (0, 3)


@given(st.integers(0, 2**32 - 1), st.integers(1, 300))
def test_order_does_not_matter_and_nothing_is_made_up(seed: int, count: int) -> None:
    generator = np.random.default_rng(seed)
    points = generator.uniform([-0.5, -0.5, 0.0], [0.5, 0.5, 4.0], (count, 3))
    kept = {tuple(point) for point in upright_points(points)}
    assert kept <= {tuple(point) for point in points}
    assert kept == {tuple(point) for point in upright_points(generator.permutation(points))}
