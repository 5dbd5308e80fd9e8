"""Clouds of points to planar scans."""

from collections import Counter

import numpy as np
import pytest

from racecar.pipelines.bags.converters.point_clouds import PointCloudConverter
from racecar.pipelines.bags.converters.scan_reading import ScanSetup
from racecar.pipelines.bags.converters.transforms import SensorPlace
from racecar.pipelines.bags.messages import POINT_CLOUD, ros2_types
from racecar.sensors.config import SensorConfig
from tests.pipelines.bag_samples import header

ORIGIN = SensorPlace(np.eye(4), "test")


def message(points, columns=None, datatype=7, big_endian=False, padding=0, row_padding=0, rows=1):
    types = ros2_types().types
    kind = np.dtype((">" if big_endian else "<") + {7: "f4", 8: "f8"}[datatype])
    step = 3 * kind.itemsize + padding
    data = np.zeros((len(points), step), dtype=np.uint8)
    data[:, : 3 * kind.itemsize] = (
        np.ascontiguousarray(points, dtype=kind).view(np.uint8).reshape(len(points), -1)
    )
    width = len(points) // rows
    lines = np.zeros((rows, width * step + row_padding), dtype=np.uint8)
    lines[:, : width * step] = data.reshape(rows, -1)
    field = types["sensor_msgs/msg/PointField"]
    return types[POINT_CLOUD](
        header=header(types),
        height=rows,
        width=width,
        fields=[
            field(name=name, offset=index * kind.itemsize, datatype=datatype, count=1)
            for index, name in enumerate(columns or "xyz")
        ],
        is_bigendian=big_endian,
        point_step=step,
        row_step=width * step + row_padding,
        data=lines.ravel(),
        is_dense=False,
    )


def convert(sent, place=ORIGIN, **config):
    counts = Counter()
    setup = ScanSetup(place, 1.0, config=SensorConfig(**config))
    return PointCloudConverter(setup, counts).convert(sent, 7), counts


@pytest.mark.parametrize(
    "layout",
    [
        {},
        {"datatype": 8},
        {"big_endian": True},
        {"padding": 5},
        {"rows": 2, "row_padding": 9, "padding": 4},
    ],
)
def test_any_layout_gives_the_points_sorted_by_bearing(layout):
    points = np.array([[0.0, 2.0, 0.0], [3.0, 0.0, 0.0], [-1.0, -1.0, 0.0], [0.0, -4.0, 0.0]])
    scan, _ = convert(message(points, **layout))
    np.testing.assert_allclose(scan.points_in_base(), points[[2, 3, 1, 0], :2], atol=1e-6)
    assert (np.diff(scan.bearings) > 0).all()
    assert not scan.time_offsets.any()


def test_only_points_within_the_band_of_heights_count():
    points = np.array([[2.0, 0.0, 0.05], [2.0, 0.5, 0.5], [2.0, 1.0, 0.9], [2.0, 1.5, 1.2]])
    scan, _ = convert(message(points))
    np.testing.assert_allclose(scan.points_in_base(), points[1:3, :2], atol=1e-6)


def test_the_band_is_above_the_base_and_the_view_is_from_the_sensor():
    place = np.eye(4)
    place[:3, 3] = 0.3, 0.0, 0.6
    points = np.array([[1.0, 0.0, -0.55], [1.0, 1.0, -0.3], [1.0, 2.0, 0.3]])
    scan, _ = convert(message(points), SensorPlace(place, "test"))
    np.testing.assert_allclose(scan.base_from_laser, [0.3, 0.0, 0.0])
    np.testing.assert_allclose(scan.points_in_base(), [[1.3, 1.0], [1.3, 2.0]], atol=1e-6)
    np.testing.assert_allclose(scan.ranges, np.hypot(1.0, [1.0, 2.0]), rtol=1e-6)


def test_of_points_on_one_bearing_the_nearest_is_seen():
    scan, _ = convert(message([[2.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 3.0, 0.0]]))
    np.testing.assert_allclose(scan.ranges, [1.0, 3.0])


def test_a_cloud_of_many_rows_becomes_one_beam_per_quarter_of_a_degree():
    angle = np.linspace(-np.pi, np.pi, 20_000, endpoint=False)
    rows = [
        np.column_stack([r * np.cos(angle), r * np.sin(angle), np.full_like(angle, h)])
        for r, h in ((3, 0.2), (5, 0.8))
    ]
    scan, _ = convert(message(np.concatenate(rows)))
    assert 1438 <= len(scan.bearings) <= 1442
    assert (np.diff(scan.bearings) > 0).all()
    np.testing.assert_allclose(scan.ranges, 3.0, rtol=1e-6)


def test_points_that_are_not_numbers_are_left_out_and_counted():
    scan, counts = convert(
        message([[np.nan, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, np.inf, 0.0]])
    )
    assert len(scan.ranges) == 2
    assert counts["beams_nan"] == 2


@pytest.mark.parametrize(
    "sent", [message([[1.0, 0.0, 5.0], [1.0, 1.0, 9.0]]), message([[1.0, 1.0, 0.0]] * 3, columns="abc")]
)
def test_clouds_without_a_usable_point(sent):
    scan, counts = convert(sent)
    assert scan is None
    assert counts["empty_scans"] == 1


def around(heights, count=200):
    """(N, 3) a round wall 3 m away, row by row."""
    angle, height = np.meshgrid(np.linspace(-3.1, 3.1, count), heights)
    return np.column_stack([3.0 * np.cos(angle.ravel()), 3.0 * np.sin(angle.ravel()), height.ravel()])


def test_sensor_with_many_rows_hands_on_its_whole_cloud_level_and_above_the_base():
    """The sensor is 0.6 m up, turned and upside down."""
    place = np.array([[0, 1, 0, 0.3], [1, 0, 0, 0], [0, 0, -1, 0.6], [0, 0, 0, 1.0]])
    points = around(np.linspace(-1.2, 0.6, 16))
    scan, _ = convert(message([*points, [np.nan, 0, 0], [500.0, 0, 0]]), SensorPlace(place, "test"))
    assert scan.cloud.points.dtype == np.float32
    assert len(scan.cloud.points) == len(scan.cloud.time_offsets) == len(points)
    np.testing.assert_allclose(scan.cloud.points[:, 2], 0.6 - points[:, 2], atol=1e-6)
    in_base = points[:, [1, 0]] + [0.3, 0.0]
    turned = scan.base_from_laser[2]
    cos, sin = np.cos(turned), np.sin(turned)
    found = scan.cloud.points[:, :2] @ np.array([[cos, sin], [-sin, cos]]) + scan.base_from_laser[:2]
    np.testing.assert_allclose(found, in_base, atol=1e-5)
    assert not scan.cloud.time_offsets.any()


def test_of_many_rows_one_beam_per_bearing_remains_however_few_they_are():
    rows = around([0.2, 0.6, 0.8, 2.0], count=90).reshape(4, 90, 3)
    rows[1, :, :2] *= 0.9
    rows[2, :, 1] += 1e-5
    scan, _ = convert(message(rows.reshape(-1, 3)))
    np.testing.assert_allclose(scan.ranges, 2.7, rtol=1e-6)
    assert len(scan.ranges) == 90


def test_beams_bear_the_times_of_their_points():
    scan, _ = convert(message([[1.0, 1.0, 0.05], [1.0, -1.0, 0.02]], columns=["x", "y", "time"]))
    np.testing.assert_allclose(scan.time_offsets, [0.02, 0.05], rtol=1e-6)


def test_times_that_cannot_be_true_are_counted_and_left_aside():
    scan, counts = convert(message([[1.0, 1.0, 50.0], [1.0, -1.0, 20.0]], columns=["x", "y", "time"]))
    assert not scan.time_offsets.any()
    assert counts["point_times_ignored"] == 1


@pytest.mark.parametrize("tilt", [0.0, 0.3])
def test_planar_sensor_hands_on_no_cloud_even_tilted(tilt):
    points = around([0.0])
    points[:, 2] = 0.5 + np.tan(tilt) * points[:, 0]
    scan, _ = convert(message(points), min_height=-2.0, max_height=2.0)
    assert scan.cloud is None
    assert len(scan.ranges) == len(points)


@pytest.mark.filterwarnings("error")
def test_coordinates_of_damaged_bytes_are_left_out():
    points = np.array(
        [[1.0, 0.0, 0.5], [1e300, 1.0, 0.5], [0.0, -1e308, 0.5], [np.inf, 0, 0], [0.0, 2.0, 0.5]]
    )
    scan, counts = convert(message(points, datatype=8))
    np.testing.assert_allclose(scan.ranges, [1.0, 2.0])
    assert counts["beams_nan"] == 3


def test_the_settings_say_how_near_and_far_points_count():
    points = [[0.4, 0.0, 0.0], [0.0, 0.6, 0.0], [-2.9, 0.0, 0.0], [0.0, -3.1, 0.0]]
    scan, _ = convert(message(points), min_range=0.5, max_range=3.0)
    np.testing.assert_allclose(scan.ranges, [0.6, 2.9])
    assert scan.max_range == 3.0
