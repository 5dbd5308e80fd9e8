import numpy as np
import pytest

from racecar.localization.sensor.beams import select_beams
from racecar.maps.geometry.se2 import IDENTITY, compose, inverse, transform_points
from racecar.maps.sensing.odometry import Odometry
from racecar.maps.sensing.odometry_buffer import OdometryBuffer
from racecar.maps.sensing.scan import Scan
from tests.maps.drives import BASE_FROM_LASER


def make_scan(ranges: np.ndarray, offsets: np.ndarray | None = None) -> Scan:
    bearings = np.linspace(-2.0, 2.0, len(ranges))
    offsets = np.zeros(len(ranges)) if offsets is None else offsets
    return Scan(10**9, bearings, ranges, offsets, BASE_FROM_LASER, 30.0)


def still(stamps: np.ndarray) -> np.ndarray:
    return np.zeros((len(stamps), 3))


def test_beams_are_taken_evenly_over_what_is_known() -> None:
    ranges = np.arange(1.0, 1001.0)
    ranges[500:] = np.nan
    ranges[:500:7] = np.inf
    beams = select_beams(make_scan(ranges), 100, still)
    assert len(beams) == 100
    assert not np.isnan(beams.ranges).any()
    assert np.isinf(beams.ranges).any()
    assert np.ptp(np.diff(beams.bearings)) < 2.0 * 4.0 / 999


def test_few_beams_are_all_taken() -> None:
    assert len(select_beams(make_scan(np.array([1.0, np.nan, 3.0])), 100, still)) == 2
    assert len(select_beams(make_scan(np.full(5, np.nan)), 100, still)) == 0


def test_a_scan_of_misses_alone_says_nothing() -> None:
    assert len(select_beams(make_scan(np.full(50, np.inf)), 100, still)) == 0
    assert len(select_beams(make_scan(np.array([*np.full(50, np.inf), 2.0])), 100, still)) == 51


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
    beams = select_beams(scan, 3, odometry.pose_at)
    ends = np.column_stack([beams.ranges * np.cos(beams.bearings), beams.ranges * np.sin(beams.bearings)])
    np.testing.assert_allclose(transform_points(BASE_FROM_LASER, ends), points, atol=1e-5)
    assert np.abs(scan.ranges - beams.ranges).max() > 0.05


@pytest.mark.parametrize("offset", [np.nan, np.inf, -2.0, 1.5])
def test_beams_whose_times_cannot_be_are_taken_as_of_the_stamp(offset: float) -> None:
    def driving(stamps: np.ndarray) -> np.ndarray:
        return np.outer(stamps * 1e-9, [3.0, 0.0, 1.0])

    ranges, offsets = np.full(20, 4.0), np.linspace(0.0, 0.02, 20)
    assert np.any(select_beams(make_scan(ranges, offsets), 20, driving).ranges != ranges)
    offsets[7] = offset
    np.testing.assert_array_equal(select_beams(make_scan(ranges, offsets), 20, driving).ranges, ranges)
