"""MultiEchoLaserScan messages, of which the first echoes count, from bags of ROS 1 and ROS 2."""

from collections import Counter

import numpy as np
import pytest

from racecar.pipelines.bags.converters.multi_echo import MultiEchoConverter
from racecar.pipelines.bags.converters.scan_reading import ScanSetup
from racecar.pipelines.bags.converters.transforms import SensorPlace
from racecar.pipelines.bags.messages import MULTI_ECHO_SCAN, ros1_types, ros2_types
from racecar.pipelines.bags.writer import BagWriter
from tests.pipelines.bag_samples import START, STEP, header, numbers_of, odometry, read

ECHOES = [[1.0, 2.0], [3.0], [], [np.inf], [0.05, 4.0]]


def message(store, index=0, unit=1.0):
    types = store.types
    beams = [
        types["sensor_msgs/msg/LaserEcho"](echoes=np.array(each, np.float32) / np.float32(unit))
        for each in ECHOES
    ]
    return types[MULTI_ECHO_SCAN](
        header=header(types, START + index * STEP, **({"seq": 0} if store is ros1_types() else {})),
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


def bag_of_echoes(path, types=ros2_types, unit=1.0):
    with BagWriter(path) as writer:
        for index in range(10):
            writer.write_odometry(odometry(index))
            sent = message(types(), index, unit)
            writer.write_message("/echoes", MULTI_ECHO_SCAN, sent, START + index * STEP)
    return path


@pytest.mark.parametrize(
    ("name", "types", "unit"),
    [("drive.bag", ros1_types, 1.0), ("drive", ros2_types, 1.0), ("drive", ros2_types, 1e-3)],
)
def test_is_read_from_bags_in_whatever_unit(tmp_path, name, types, unit):
    scans, _, reader = read(bag_of_echoes(tmp_path / name, types, unit))
    assert (reader.scan_topic, len(scans)) == ("/echoes", 10)
    np.testing.assert_allclose(scans[3].ranges, [1.0, 3.0, np.nan, np.inf, np.nan])
    if unit < 1.0:
        assert numbers_of("ranges_in_another_unit", reader)["unit"] == "millimetres"
