"""A sweep taken in motion lies as if taken at its stamp."""

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from racecar.maps.geometry.se2 import Pose, chained, compose, inverse, transform_points
from racecar.sensors.cloud import Cloud
from racecar.sensors.motion.deskew import by_odometry, by_velocity, deskew, deskew_cloud
from racecar.sensors.motion.odometry_buffer import OdometryBuffer
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

PLACE = np.array([0.3, 0.1, 0.2])
STAMP = 1_000_000_000
LANDMARKS = np.array([[4.0, -3.0, 0.2], [5.0, -1.0, 0.5], [5.0, 1.0, 1.9], [3.0, 4.0, -0.1]])
OFFSETS = np.linspace(0.0, 0.1, len(LANDMARKS))
poses = st.tuples(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0), st.floats(-np.pi, np.pi)).map(np.array)


def steadily(seconds: np.ndarray, speed: float, turning_speed: float) -> Pose:
    """(N, 3) of a car on a circle."""
    yaw = turning_speed * seconds
    chord = speed * seconds * np.sinc(yaw / (2.0 * np.pi))
    return np.column_stack([chord * np.cos(yaw / 2), chord * np.sin(yaw / 2), yaw])


def sweep(speed: float, turning_speed: float) -> Scan:
    """Each landmark seen at its own time, from wherever the laser is then."""
    seen = LANDMARKS.copy()
    for point, start_from_base in zip(seen, steadily(OFFSETS, speed, turning_speed), strict=True):
        point[:2] = transform_points(inverse(compose(start_from_base, PLACE)), point[None, :2])[0]
    bearings, ranges = np.arctan2(seen[:, 1], seen[:, 0]), np.hypot(seen[:, 0], seen[:, 1])
    cloud = Cloud(seen.astype(np.float32), OFFSETS.astype(np.float32))
    return Scan(STAMP, bearings, ranges, OFFSETS, PLACE, 30.0, cloud)


@given(poses, st.floats(-6.0, 6.0), st.floats(-4.0, 4.0))
def test_any_steady_motion_is_taken_out_wherever_odometry_starts(
    odom_from_start: Pose, speed: float, turning_speed: float
) -> None:
    odometry, seconds = OdometryBuffer(), np.arange(-0.01, 0.12, 0.001)
    for at, pose in zip(
        seconds, compose(odom_from_start, steadily(seconds, speed, turning_speed)), strict=True
    ):
        odometry.add(Odometry(STAMP + round(1e9 * at), pose, np.zeros(3)))
    scan = sweep(speed, turning_speed)
    motion = by_odometry(scan, odometry)
    expected = transform_points(inverse(PLACE), LANDMARKS[:, :2])
    np.testing.assert_allclose(deskew(scan, motion), expected, atol=1e-4)
    points = deskew_cloud(scan, motion)
    np.testing.assert_allclose(points[:, :2], expected, atol=1e-4)
    np.testing.assert_allclose(points[:, 2], LANDMARKS[:, 2], atol=1e-6)
    assert deskew_cloud(replace(scan, cloud=None), motion) is None


def test_without_odometry_all_is_as_measured() -> None:
    scan = sweep(1.0, 1.0)
    unknown = by_odometry(scan, OdometryBuffer())
    np.testing.assert_array_equal(deskew(scan, unknown), scan.points_in_laser())
    np.testing.assert_array_equal(deskew_cloud(scan, unknown), scan.cloud.points)


@given(st.tuples(st.floats(-6.0, 6.0), st.floats(-1.0, 1.0), st.floats(-4.0, 4.0)).map(np.array))
def test_a_steady_velocity_leads_along_an_arc(velocity: np.ndarray) -> None:
    """Many small steps lead to the same place."""
    steps = chained(np.tile(1e-4 * velocity, (1000, 1)))
    np.testing.assert_allclose(by_velocity(velocity)(np.array([0.1]))[0], steps[-1], atol=1e-3)
