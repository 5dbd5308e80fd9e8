import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecar.localization.sensor.end_points import evenly, select_points
from racecar.maps.geometry.se2 import IDENTITY, compose, inverse, transform_points
from racecar.sensors.motion.odometry_buffer import OdometryBuffer
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.sensors.drives import BASE_FROM_LASER


def make_scan(ranges: np.ndarray, offsets: np.ndarray | None = None) -> Scan:
    bearings = np.linspace(-2.0, 2.0, len(ranges))
    offsets = np.zeros(len(ranges)) if offsets is None else offsets
    return Scan(10**9, bearings, ranges, offsets, BASE_FROM_LASER, 30.0)


def still(stamps: np.ndarray) -> np.ndarray:
    return np.zeros((len(stamps), 3))


def test_points_are_taken_evenly_over_what_was_measured() -> None:
    ranges = np.arange(1.0, 1001.0)
    ranges[500:] = np.nan
    ranges[:500:7] = np.inf
    points = select_points(make_scan(ranges), 100, still)
    numbers = np.rint(np.hypot(*(points.in_base - BASE_FROM_LASER[:2]).T)) - 1
    measured = np.linspace(0, 499, 100).round()
    np.testing.assert_array_equal(numbers, measured[measured % 7 != 0])


@given(st.integers(0, 2000), st.integers(1, 200))
def test_numbers_are_even_and_reach_both_ends(total: int, count: int) -> None:
    chosen = evenly(total, count)
    assert len(chosen) == min(total, count)
    assert np.ptp(np.diff(chosen)) <= 1 if len(chosen) > 1 else True
    if len(chosen) > 0:
        assert chosen[0] == 0
    if len(chosen) > 1:
        assert chosen[-1] == total - 1


def test_where_they_end_is_seen_from_the_base() -> None:
    scan = make_scan(np.linspace(1.0, 3.0, 30))
    points = select_points(scan, 30, still)
    np.testing.assert_allclose(points.in_base, scan.points_in_base(), atol=1e-12)
    np.testing.assert_array_equal(points.laser, BASE_FROM_LASER[:2])


@pytest.mark.parametrize("nothing", [np.nan, np.inf, 1e39])
def test_beams_that_met_nothing_are_left_out(nothing: float) -> None:
    assert len(select_points(make_scan(np.array([1.0, nothing, 3.0])), 100, still)) == 2
    assert len(select_points(make_scan(np.full(50, nothing)), 100, still)) == 0
    assert len(select_points(make_scan(np.array([*np.full(50, nothing), 2.0])), 100, still)) == 1


@pytest.mark.parametrize("bearing", [np.nan, np.inf])
def test_beams_that_went_nobody_knows_where_are_left_out(bearing: float) -> None:
    scan = make_scan(np.ones(5))
    scan.bearings[3] = bearing
    assert len(select_points(scan, 100, still)) == 4


def test_a_sweep_on_the_move_is_set_back_to_its_stamp() -> None:
    """A point stays where it is while the car drives and turns by it."""
    odometry = OdometryBuffer()
    for k in range(6):
        odometry.add(Odometry(10**9 + k * 4_000_000, np.array([0.024 * k, 0.0, 0.01 * k]), IDENTITY))
    points = np.array([[4.0, -3.0], [5.0, 0.5], [2.0, 3.0]])
    offsets = np.array([0.0, 0.008, 0.016])
    seen = []
    for point, offset in zip(points, offsets, strict=True):
        odom_from_laser = compose(odometry.pose_at(10**9 + int(offset * 1e9)), BASE_FROM_LASER)
        seen.append(transform_points(inverse(odom_from_laser), point[None])[0])
    x, y = np.array(seen).T
    scan = Scan(10**9, np.arctan2(y, x), np.hypot(x, y), offsets, BASE_FROM_LASER, 30.0)
    np.testing.assert_allclose(select_points(scan, 3, odometry.pose_at).in_base, points, atol=1e-9)
    assert np.abs(scan.points_in_base() - points).max() > 0.05


@pytest.mark.parametrize("offset", [np.nan, np.inf, -2.0, 1.5])
def test_beams_whose_times_cannot_be_are_taken_as_of_the_stamp(offset: float) -> None:
    def driving(stamps: np.ndarray) -> np.ndarray:
        return np.outer(stamps * 1e-9, [3.0, 0.0, 1.0])

    ranges, offsets = np.full(20, 4.0), np.linspace(0.0, 0.02, 20)
    as_of_stamp = select_points(make_scan(ranges), 20, driving).in_base
    assert np.any(select_points(make_scan(ranges, offsets), 20, driving).in_base != as_of_stamp)
    offsets[7] = offset
    found = select_points(make_scan(ranges, offsets), 20, driving).in_base
    np.testing.assert_array_equal(found, as_of_stamp)
