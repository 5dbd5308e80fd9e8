"""Scan odometry of planar scans and of clouds, in a room whose walls are known."""

import numpy as np
import pytest

from racecar.maps.geometry.se2 import IDENTITY, Pose, between
from racecar.sensors.motion.scan_odometry import ScanOdometry

WEST, EAST, SOUTH, NORTH = -6.0, 9.0, -3.0, 4.0
HEIGHT, CEILING = 0.4, 2.5
STEP = np.array([0.08, 0.0, 0.01])


def ranges_in_room(pose: Pose, bearings: np.ndarray) -> np.ndarray:
    """(N,) metres to the walls."""
    x, y, yaw = pose
    cos, sin = np.cos(yaw + bearings), np.sin(yaw + bearings)
    to_x = np.where(cos > 0, EAST - x, WEST - x) / cos
    to_y = np.where(sin > 0, NORTH - y, SOUTH - y) / sin
    return np.minimum(to_x, to_y)


def planar_scan(pose: Pose) -> np.ndarray:
    bearings = np.radians(np.arange(-179.8, 180.0, 0.5))
    ranges = ranges_in_room(pose, bearings)
    return np.column_stack([ranges * np.cos(bearings), ranges * np.sin(bearings)])


def cloud(pose: Pose) -> np.ndarray:
    """Of 16 rows; as many points on floor and ceiling as on the walls. Heights above the floor."""
    up = np.tan(np.radians(np.arange(-15.0, 16.0, 2.0)))
    bearings = np.radians(np.arange(-179.8, 180.0, 0.5))
    to_plates = np.where(up < 0, -HEIGHT / up, (CEILING - HEIGHT) / up)
    across = np.minimum(ranges_in_room(pose, bearings)[:, None], to_plates)
    across += 0.01 * np.random.default_rng(int(1e4 * pose[0])).standard_normal(across.shape)
    x, y = across * np.cos(bearings)[:, None], across * np.sin(bearings)[:, None]
    return np.stack([x, y, HEIGHT + across * up], axis=-1).reshape(-1, 3)


@pytest.mark.parametrize("see", [planar_scan, cloud])
@pytest.mark.parametrize("is_predicted", [True, False])
def test_path_is_found(see, is_predicted: bool) -> None:
    odometry = ScanOdometry()
    poses, found = [np.zeros(3)], [odometry.register(see(np.zeros(3)), IDENTITY)]
    for _ in range(30):
        yaw = poses[-1][2]
        step = np.array([STEP[0] * np.cos(yaw), STEP[0] * np.sin(yaw), STEP[2]])
        poses.append(poses[-1] + step)
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
