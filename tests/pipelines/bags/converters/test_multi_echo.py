"""MultiEchoLaserScan messages, of which the first echoes count, from bags of ROS 1 and ROS 2."""

from collections import Counter

import numpy as np
import pytest

from racecar.pipelines.bags.converters.multi_echo import MultiEchoConverter
from racecar.pipelines.bags.converters.scan_reading import ScanSetup
from racecar.pipelines.bags.converters.transforms import SensorPlace
from racecar.pipelines.bags.messages import MULTI_ECHO_SCAN, ros1_types, ros2_types
from racecar.pipelines.bags.writer import BagWriter
from tests.pipelines.bag_samples import START, STEP, numbers_of, odometry, read

ECHOES = [[1.0, 2.0], [3.0], [], [np.inf], [0.05, 4.0]]


def message(store, index=0, unit=1.0):
    types, is_ros1 = store.types, store is ros1_types()
    sec, nanosec = divmod(START + index * STEP, 10**9)
    beams = [
        types["sensor_msgs/msg/LaserEcho"](echoes=np.array(each, np.float32) / np.float32(unit))
        for each in ECHOES
    ]
    return types[MULTI_ECHO_SCAN](
        header=types["std_msgs/msg/Header"](
            stamp=types["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec),
            frame_id="laser",
            **({"seq": 0} if is_ros1 else {}),
        ),
        angle_min=-0.2,
        angle_max=0.2,
        angle_increment=0.1,
        time_increment=0.001,
        scan_time=0.1,
        range_min=0.1,
        range_max=10.0,
        ranges=beams,
        intensities=[],
    )


def test_the_first_echo_of_each_beam_counts():
    converter = MultiEchoConverter(ScanSetup(SensorPlace(np.eye(4), "test"), 1.0), Counter())
    scan = converter.convert(message(ros2_types()), 5)
    np.testing.assert_allclose(scan.ranges, [1.0, 3.0, np.nan, np.inf, np.nan])
    np.testing.assert_allclose(scan.bearings, [-0.2, -0.1, 0.0, 0.1, 0.2], atol=1e-7)
    np.testing.assert_allclose(scan.time_offsets, np.arange(5) * 1e-3)
    assert (scan.stamp, scan.max_range) == (5, 10.0)


@pytest.mark.parametrize(("name", "types"), [("drive.bag", ros1_types), ("drive", ros2_types)])
def test_is_read_from_bags(tmp_path, name, types):
    with BagWriter(tmp_path / name) as writer:
        for index in range(10):
            writer.write_odometry(odometry(index))
            sent = message(types(), index)
            writer.write_message("/echoes", MULTI_ECHO_SCAN, sent, START + index * STEP)
    scans, _, reader = read(tmp_path / name)
    assert (reader.scan_topic, len(scans)) == ("/echoes", 10)
    np.testing.assert_allclose(scans[3].ranges, [1.0, 3.0, np.nan, np.inf, np.nan])


def test_ranges_in_millimetres_are_found_by_the_echoes(tmp_path):
    with BagWriter(tmp_path / "drive") as writer:
        for index in range(10):
            writer.write_odometry(odometry(index))
            sent = message(ros2_types(), index, unit=1e-3)
            writer.write_message("/echoes", MULTI_ECHO_SCAN, sent, START + index * STEP)
    scans, _, reader = read(tmp_path / "drive")
    np.testing.assert_allclose(scans[3].ranges, [1.0, 3.0, np.nan, np.inf, np.nan])
    assert numbers_of("ranges_in_another_unit", reader)["unit"] == "millimetres"
