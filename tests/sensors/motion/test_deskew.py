"""A sweep taken in motion lies as if taken at its stamp."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecar.maps.geometry.se2 import compose, inverse, transform_points
from racecar.sensors.cloud import Cloud
from racecar.sensors.motion.deskew import by_odometry, by_velocity, deskew, deskew_cloud
from racecar.sensors.motion.odometry_buffer import OdometryBuffer
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

PLACE = np.array([0.3, 0.1, 0.2])
STAMP = 1_000_000_000
LANDMARKS = np.array([[4.0, -3.0, 0.2], [5.0, -1.0, 0.5], [5.0, 1.0, 1.9], [3.0, 4.0, -0.1]])


def base_at(seconds: float) -> np.ndarray:
    """A car that turns on a circle."""
    return np.array([np.sin(seconds), 1.0 - np.cos(seconds), seconds])


def buffer() -> OdometryBuffer:
    odometry = OdometryBuffer()
    for step in range(-1, 13):
        seconds = 0.01 * step
        odometry.add(Odometry(STAMP + 10_000_000 * step, base_at(seconds), np.array([1.0, 0.0, 1.0])))
    return odometry


@pytest.fixture
def scan() -> Scan:
    """Each landmark seen at its own time."""
    offsets = np.array([0.0, 0.03, 0.065, 0.1])
    seen = LANDMARKS.copy()
    for point, seconds in zip(seen, offsets, strict=True):
        odom_from_laser = compose(base_at(seconds), PLACE)
        point[:2] = transform_points(inverse(odom_from_laser), point[None, :2])[0]
    bearings, ranges = np.arctan2(seen[:, 1], seen[:, 0]), np.hypot(seen[:, 0], seen[:, 1])
    cloud = Cloud(seen.astype(np.float32), offsets.astype(np.float32))
    return Scan(STAMP, bearings, ranges, offsets, PLACE, 30.0, cloud)


def test_beams_and_points_lie_where_the_landmarks_are(scan: Scan) -> None:
    expected = transform_points(inverse(compose(base_at(0.0), PLACE)), LANDMARKS[:, :2])
    motion = by_odometry(scan, buffer())
    np.testing.assert_allclose(deskew(scan, motion), expected, atol=1e-4)
    points = deskew_cloud(scan, motion)
    np.testing.assert_allclose(points[:, :2], expected, atol=1e-4)
    np.testing.assert_allclose(points[:, 2], LANDMARKS[:, 2], atol=1e-6)


def test_without_odometry_all_is_as_measured(scan: Scan) -> None:
    unknown = by_odometry(scan, OdometryBuffer())
    np.testing.assert_array_equal(deskew(scan, unknown), scan.points_in_laser())
    np.testing.assert_array_equal(deskew_cloud(scan, unknown), scan.cloud.points)


def test_planar_scan_has_no_cloud(scan: Scan) -> None:
    planar = Scan(STAMP, scan.bearings, scan.ranges, scan.time_offsets, PLACE, 30.0)
    assert deskew_cloud(planar, by_odometry(planar, buffer())) is None


poses = st.tuples(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0), st.floats(-np.pi, np.pi)).map(np.array)


@given(poses, st.floats(-6.0, 6.0), st.floats(-4.0, 4.0))
def test_any_steady_motion_is_taken_out_wherever_odometry_starts(
    odom_from_start: np.ndarray, speed: float, turning_speed: float
) -> None:
    offsets = np.linspace(0.0, 0.1, len(LANDMARKS))

    def start_from_laser(seconds: float) -> np.ndarray:
        yaw = turning_speed * seconds
        chord = speed * seconds * np.sinc(yaw / (2.0 * np.pi))
        return compose([chord * np.cos(yaw / 2), chord * np.sin(yaw / 2), yaw], PLACE)

    odometry = OdometryBuffer()
    for seconds in np.arange(-0.01, 0.12, 0.001):
        base = compose(start_from_laser(seconds), inverse(PLACE))
        sample = Odometry(STAMP + round(1e9 * seconds), compose(odom_from_start, base), np.zeros(3))
        odometry.add(sample)
    seen = np.array(
        [
            transform_points(inverse(start_from_laser(seconds)), point[None, :2])[0]
            for seconds, point in zip(offsets, LANDMARKS, strict=True)
        ]
    )
    bearings, ranges = np.arctan2(seen[:, 1], seen[:, 0]), np.hypot(seen[:, 0], seen[:, 1])
    sweep = Scan(STAMP, bearings, ranges, offsets, PLACE, 30.0)
    expected = transform_points(inverse(PLACE), LANDMARKS[:, :2])
    np.testing.assert_allclose(deskew(sweep, by_odometry(sweep, odometry)), expected, atol=1e-4)


@given(st.tuples(st.floats(-6.0, 6.0), st.floats(-1.0, 1.0), st.floats(-4.0, 4.0)).map(np.array))
def test_a_steady_velocity_leads_along_an_arc(velocity: np.ndarray) -> None:
    """Many small steps lead to the same place."""
    place = np.zeros(3)
    for _ in range(1000):
        place = compose(place, 1e-4 * velocity)
    np.testing.assert_allclose(by_velocity(velocity)(np.array([0.1]))[0], place, atol=1e-3)
