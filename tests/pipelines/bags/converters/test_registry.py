"""Another message type is one converter and one entry in the registry, for bags and nodes alike."""

import numpy as np
import pytest

from racecar.maps.errors import UserError
from racecar.pipelines.bags.converters.registry import SCAN_CONVERTERS
from racecar.pipelines.bags.messages import ros2_types
from racecar.pipelines.live.intake.sensors import Sensors
from racecar.pipelines.live.monitoring.faults import Faults
from racecar.sensors.scan import Scan
from tests.pipelines.bag_samples import START, STEP, bag_of, header, odometry, read

SONAR = "sensor_msgs/msg/Range"


class SonarConverter:
    """A single distance, as a scan of two beams."""

    def __init__(self, setup, counts):
        self._place, self._counts = setup.place.pose, counts

    def convert(self, message, stamp):
        if not message.range > 0.0:
            self._counts["empty_scans"] += 1
            return None
        half = message.field_of_view / 2
        bearings = np.array([-half, half])
        return Scan(stamp, bearings, np.full(2, message.range), np.zeros(2), self._place, message.max_range)


def sonar_message(stamp, distance):
    types = ros2_types().types
    return types[SONAR](
        header=header(types, stamp, "base_link"),
        radiation_type=0,
        field_of_view=0.2,
        min_range=0.1,
        max_range=4.0,
        range=distance,
        variance=0.0,
    )


@pytest.fixture
def sonar_bag(tmp_path):
    def write(writer):
        for index in range(10):
            stamp = START + index * STEP
            writer.write_odometry(odometry(index))
            writer.write_message("/sonar", SONAR, sonar_message(stamp, 0.0 if index == 3 else 1.5), stamp)

    return bag_of(tmp_path / "sonar", write)


def test_a_bag_of_an_unknown_type_holds_no_scans(sonar_bag):
    known = r"no laser scans \(LaserScan, MultiEchoLaserScan or PointCloud2\)"
    with pytest.raises(UserError, match=known + ".*sensor_msgs/msg/Range"):
        read(sonar_bag)


def test_a_registered_type_is_read_from_bags(sonar_bag, monkeypatch):
    monkeypatch.setitem(SCAN_CONVERTERS, SONAR, SonarConverter)
    scans, samples, reader = read(sonar_bag)
    assert (reader.scan_topic, len(scans), len(samples)) == ("/sonar", 9, 10)
    np.testing.assert_allclose(scans[0].bearings, [-0.1, 0.1], atol=1e-7)
    assert reader.counts["empty_scans"] == 1
    with pytest.raises(UserError, match="LaserScan, MultiEchoLaserScan, PointCloud2 or Range"):
        read(bag_of(sonar_bag.parent / "other", lambda writer: writer.write_odometry(odometry(0))))


def test_a_registered_type_is_taken_by_the_nodes(monkeypatch):
    monkeypatch.setitem(SCAN_CONVERTERS, SONAR, SonarConverter)
    taking = Sensors(
        base_frame="base_link",
        laser_pose=None,
        integrate_twist=False,
        faults=Faults(pytest.fail, pytest.fail),
        aside=lambda work: work(),
    )
    scan = taking.scan(sonar_message(START, 1.5), 0)
    assert scan is not None
    np.testing.assert_allclose(scan.ranges, 1.5)
