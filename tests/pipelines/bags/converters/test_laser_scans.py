"""LaserScan messages as drivers send them."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecar.pipelines.bags.converters.laser_scans import RANGE_LIMIT, LaserScanConverter
from racecar.pipelines.bags.converters.scan_reading import ScanSetup
from racecar.pipelines.bags.converters.transforms import SensorPlace
from racecar.pipelines.bags.messages import LASER_SCAN, ros2_types
from racecar.sensors.config import SensorConfig
from tests.pipelines.bag_samples import header

UPRIGHT = SensorPlace(np.eye(4), "test")
UPSIDE_DOWN = SensorPlace(np.diag([1.0, -1.0, -1.0, 1.0]), "test")


def message(ranges, **changes):
    types = ros2_types().types
    ranges = np.asarray(ranges, dtype=np.float32)
    values = {
        "header": header(types),
        "angle_min": -1.0,
        "angle_max": -1.0 + 0.1 * (len(ranges) - 1),
        "angle_increment": 0.1,
        "time_increment": 0.001,
        "scan_time": 0.1,
        "range_min": 0.1,
        "range_max": 10.0,
        "ranges": ranges,
        "intensities": np.empty(0, dtype=np.float32),
    }
    return types[LASER_SCAN](**{**values, **changes})


def convert(sent, place=UPRIGHT, longest_sweep=1.0, **config):
    counts = Counter()
    setup = ScanSetup(place, longest_sweep, config=SensorConfig(**config))
    return LaserScanConverter(setup, counts).convert(sent, 5), counts


def test_returns_misses_and_beams_that_tell_nothing():
    ranges = [1.0, np.inf, 10.0, 65.533, np.nan, 0.0, -1.0, 0.05, -np.inf, 9.99]
    scan, counts = convert(message(ranges))
    expected = [1.0, np.inf, np.inf, np.inf, np.nan, np.nan, np.nan, np.nan, np.nan, 9.99]
    np.testing.assert_allclose(scan.ranges, expected, rtol=1e-6)
    assert (scan.stamp, scan.max_range) == (5, 10.0)
    assert counts == {
        "beams": 10,
        "beams_missed": 3,
        "beams_nan": 1,
        "beams_zero": 1,
        "beams_below_range_min": 3,
    }


@pytest.mark.parametrize("range_max", [0.0, np.nan, -3.0, np.inf])
def test_a_range_limit_that_is_none(range_max):
    scan, counts = convert(message([1.0, 65.533], range_max=range_max))
    np.testing.assert_allclose(scan.ranges, [1.0, np.inf])
    assert (scan.max_range, counts["scans_without_range_max"]) == (RANGE_LIMIT, 1)


def test_a_negative_increment_is_turned_round_with_its_times():
    scan, _ = convert(message([1.0, 2.0, 3.0], angle_min=0.5, angle_increment=-0.25, angle_max=0.0))
    np.testing.assert_allclose(scan.bearings, [0.0, 0.25, 0.5])
    np.testing.assert_allclose(scan.ranges, [3.0, 2.0, 1.0])
    np.testing.assert_allclose(scan.time_offsets, [0.002, 0.001, 0.0])


def test_a_sensor_upside_down_is_mirrored():
    sent = message([1.0, 2.0, 3.0], angle_min=0.1)
    upright, _ = convert(sent)
    mirrored, _ = convert(sent, UPSIDE_DOWN)
    points = upright.points_in_base()
    np.testing.assert_allclose(mirrored.points_in_base()[::-1], points * [1.0, -1.0], atol=1e-12)
    assert (np.diff(mirrored.bearings) > 0).all()


def test_an_increment_of_zero_is_told_from_the_ends():
    scan, _ = convert(message([1.0] * 5, angle_increment=0.0, angle_min=0.0, angle_max=1.0))
    np.testing.assert_allclose(scan.bearings, [0.0, 0.25, 0.5, 0.75, 1.0])


@pytest.mark.parametrize(
    ("ranges", "changes"),
    [
        ([], {}),
        ([1.0, 1.0], {"angle_increment": 0.0, "angle_max": -1.0}),
        ([1.0, 1.0], {"angle_min": np.nan}),
        ([1.0, 1.0], {"angle_increment": np.nan, "angle_max": np.nan}),
    ],
)
def test_scans_that_hold_no_beams(ranges, changes):
    scan, counts = convert(message(ranges, **changes))
    assert scan is None
    assert counts["empty_scans"] == 1


@pytest.mark.parametrize(("increment", "is_believed"), [(0.001, True), (0.2, False), (np.nan, False)])
def test_a_time_increment_too_long_to_be_true(increment, is_believed):
    scan, counts = convert(message([1.0] * 11, time_increment=increment))
    np.testing.assert_allclose(scan.time_offsets, (increment if is_believed else 0.0) * np.arange(11))
    assert counts["time_increments_ignored"] == (not is_believed)


@pytest.mark.parametrize(("count", "is_left_out"), [(63, False), (64, False), (66, True), (120, True)])
def test_a_scan_of_more_than_one_turn_is_left_out(count, is_left_out):
    scan, counts = convert(message([2.0] * count))
    assert (scan is None, counts["scans_beyond_one_turn"]) == (is_left_out, int(is_left_out))


def test_a_changing_number_of_beams_is_counted():
    counts = Counter()
    converter = LaserScanConverter(ScanSetup(UPRIGHT, 1.0), counts)
    sizes = [len(converter.convert(message([1.0] * count), 0).bearings) for count in (10, 12, 12, 10)]
    assert sizes == [10, 12, 12, 10]
    assert counts["changed_beam_counts"] == 2


@given(
    start=st.floats(-7, 7),
    degrees=st.floats(0.2, 3),
    count=st.integers(2, 400),
    is_mirrored=st.booleans(),
    is_reversed=st.booleans(),
)
def test_bearings_ascend_and_points_stay(start, degrees, count, is_mirrored, is_reversed):
    increment = np.radians(-degrees if is_reversed else degrees)
    count = min(count, int(2 * np.pi / abs(increment)))
    angles = start + increment * np.arange(count)
    sent = message(1 + 0.01 * np.arange(count), angle_min=start, angle_increment=increment)
    scan, _ = convert(sent, UPSIDE_DOWN if is_mirrored else UPRIGHT)
    assert (np.diff(scan.bearings) > 0).all()
    assert (np.abs(scan.bearings) <= np.pi).all()
    beams = np.rint((scan.ranges - 1) * 100).astype(int)
    expected = sent.ranges[beams, None] * np.column_stack([np.cos(angles), np.sin(angles)])[beams]
    if is_mirrored:
        expected[:, 1] *= -1
    np.testing.assert_allclose(scan.points_in_laser(), expected, atol=1e-5)
    np.testing.assert_allclose(scan.time_offsets, 0.001 * beams, atol=1e-12)


def test_a_full_circle_that_ends_where_it_began():
    sent = message([1.0] * 361, angle_min=-np.pi, angle_increment=np.radians(1.0))
    scan, _ = convert(sent)
    assert len(scan.bearings) == 360
    assert (np.diff(scan.bearings) > 0).all()


@pytest.mark.filterwarnings("error")
def test_damaged_ranges_are_converted_without_a_warning():
    ranges = np.array([0x3F800000, 0x7FA00000, 0xFFA00000, 0x3F800000], dtype="u4").view("f4")
    scan, counts = convert(message(ranges))
    np.testing.assert_array_equal(np.isnan(scan.ranges), [False, True, True, False])
    assert counts["beams_nan"] == 2


@pytest.mark.parametrize("stated", [0.0, 2.0, 10.0])
def test_the_settings_have_the_last_word_on_how_near_and_far_readings_count(stated):
    scan, counts = convert(message([0.4, 0.6, 2.9, 3.1], range_max=stated), min_range=0.5, max_range=3.0)
    np.testing.assert_allclose(scan.ranges, [np.nan, 0.6, 2.9, np.inf], rtol=1e-6)
    assert (scan.max_range, counts["scans_without_range_max"]) == (3.0, 0)
