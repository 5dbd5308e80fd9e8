"""What ``--record`` writes is read back by rosbags, and its messages are complete."""

from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from racecar.pipelines.runs.view.recorder import RECORD_FOLDER, as_even_beams, recording
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

PERIOD = 50_000_000
START = 1_700_000_000_000_000_000
BEARINGS = np.linspace(-2.0, 2.0, 41)
BASE_FROM_LASER = np.array([0.2, 0.0, 0.1])
COVARIANCE = np.array([[0.04, 0.01, 0.002], [0.01, 0.09, 0.003], [0.002, 0.003, 0.01]])


def grid() -> OccupancyGrid:
    cells = np.full((3, 5), FREE, dtype=np.int8)
    cells[0, 1], cells[2, 4] = OCCUPIED, UNKNOWN
    return OccupancyGrid(cells, 0.5, np.array([1.0, -2.0, 0.3]))


def scan(index: int) -> Scan:
    ranges = np.full(len(BEARINGS), 3.0)
    ranges[3], ranges[5] = np.inf, np.nan
    offsets = np.linspace(0.0, 0.02, len(BEARINGS))
    return Scan(START + index * PERIOD, BEARINGS, ranges, offsets, BASE_FROM_LASER, 10.0)


def pose(index: int) -> np.ndarray:
    return np.array([0.1 * index, 0.5, 0.01 * index])


def record(folder: Path, scans: int = 30) -> dict[str, list]:
    """Write a drive and read it back: messages by topic."""
    particles = np.column_stack([np.arange(1000.0), np.zeros(1000), np.zeros(1000)])
    weights = np.where(np.arange(1000) < 500, 0.0, 1.0 / 500)
    with recording(folder, grid()) as recorder:
        for index in range(scans):
            recorder.write_odometry(Odometry(START + index * PERIOD, pose(index), np.array([1.0, 0.0, 0.2])))
            recorder.write_scan(scan(index), pose(index), COVARIANCE)
            recorder.write_particles(START + index * PERIOD, particles, weights)
    types = get_typestore(Stores.ROS2_JAZZY)
    messages: dict[str, list] = {}
    with Reader(folder / RECORD_FOLDER) as reader:
        for connection, _, data in reader.messages():
            message = types.deserialize_cdr(data, connection.msgtype)
            messages.setdefault(connection.topic, []).append(message)
    return messages


@pytest.fixture(scope="module")
def messages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list]:
    return record(tmp_path_factory.mktemp("run"))


def stamp_of(message: object) -> int:
    stamp = message.header.stamp
    return stamp.sec * 10**9 + stamp.nanosec


def test_types_are_the_standard_ones(messages: dict[str, list]) -> None:
    assert {topic: sent[0].__msgtype__ for topic, sent in messages.items()} == {
        "/map": "nav_msgs/msg/OccupancyGrid",
        "/scan": "sensor_msgs/msg/LaserScan",
        "/odom": "nav_msgs/msg/Odometry",
        "/pf/pose/odom": "nav_msgs/msg/Odometry",
        "/pf/viz/particles": "geometry_msgs/msg/PoseArray",
        "/path": "nav_msgs/msg/Path",
        "/tf": "tf2_msgs/msg/TFMessage",
        "/tf_static": "tf2_msgs/msg/TFMessage",
    }


def test_the_map_is_whole(messages: dict[str, list]) -> None:
    (message,) = messages["/map"]
    assert message.header.frame_id == "map"
    assert (message.info.width, message.info.height, message.info.resolution) == (5, 3, 0.5)
    assert (message.info.origin.position.x, message.info.origin.position.y) == (1.0, -2.0)
    assert 2 * np.arcsin(message.info.origin.orientation.z) == pytest.approx(0.3)
    np.testing.assert_array_equal(np.asarray(message.data).reshape(3, 5), grid().cells)


def test_scans_keep_their_readings_and_times(messages: dict[str, list]) -> None:
    assert [stamp_of(message) for message in messages["/scan"]] == [START + i * PERIOD for i in range(30)]
    message = messages["/scan"][4]
    assert message.header.frame_id == "laser"
    np.testing.assert_array_equal(message.ranges, scan(4).ranges.astype(np.float32))
    assert message.angle_min == pytest.approx(-2.0)
    assert message.angle_max == pytest.approx(2.0)
    assert message.time_increment == pytest.approx(0.02 / 40)
    assert message.range_max == 10.0


def test_every_scan_has_a_pose_with_its_covariance(messages: dict[str, list]) -> None:
    message = messages["/pf/pose/odom"][7]
    assert (message.header.frame_id, message.child_frame_id) == ("map", "base_link")
    assert stamp_of(message) == START + 7 * PERIOD
    assert message.pose.pose.position.x == pytest.approx(0.7)
    covariance = message.pose.covariance.reshape(6, 6)
    np.testing.assert_allclose(covariance[np.ix_([0, 1, 5], [0, 1, 5])], COVARIANCE)
    transform = messages["/tf"][7].transforms[0]
    assert (transform.header.frame_id, transform.child_frame_id) == ("map", "base_link")
    assert transform.transform.translation.x == pytest.approx(0.7)
    laser = messages["/tf_static"][0].transforms[0]
    assert (laser.header.frame_id, laser.child_frame_id) == ("base_link", "laser")
    assert laser.transform.translation.x == pytest.approx(0.2)


def test_odometry_keeps_its_twist(messages: dict[str, list]) -> None:
    message = messages["/odom"][9]
    assert (message.header.frame_id, message.child_frame_id) == ("odom", "base_link")
    assert (message.twist.twist.linear.x, message.twist.twist.angular.z) == (1.0, 0.2)
    assert not message.pose.covariance.any()


def test_particles_stand_for_the_weights_ten_times_a_second(messages: dict[str, list]) -> None:
    assert len(messages["/pf/viz/particles"]) == 15
    places = np.array([one.position.x for one in messages["/pf/viz/particles"][0].poses])
    assert len(places) == 300
    assert places.min() >= 500
    assert places.mean() == pytest.approx(749.5, abs=2.0)


def test_the_last_path_is_complete_and_all_together_do_not_grow_out_of_hand(
    messages: dict[str, list],
) -> None:
    paths = messages["/path"]
    assert [stamp_of(one) for one in paths[-1].poses] == [START + i * PERIOD for i in range(30)]
    assert paths[-1].poses[12].pose.position.x == pytest.approx(1.2)
    assert sum(len(path.poses) for path in paths) < 12 * 30


def test_scans_out_of_order_are_left_out(tmp_path: Path) -> None:
    with recording(tmp_path, grid()) as recorder:
        for index in (0, 2, 1, 3):
            recorder.write_scan(scan(index), pose(index))
    with Reader(tmp_path / RECORD_FOLDER) as reader:
        stamps = [stamp for connection, stamp, _ in reader.messages() if connection.topic == "/scan"]
    assert stamps == [START + index * PERIOD for index in (0, 2, 3)]


def test_nothing_is_left_behind_by_a_run_that_fails(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="half-way"), recording(tmp_path, grid()) as recorder:
        recorder.write_scan(scan(0), pose(0))
        raise ValueError("half-way")
    assert list(tmp_path.iterdir()) == []


def test_uneven_beams_go_to_the_nearest_bearing() -> None:
    bearings = np.array([0.0, 0.1, 0.21, 0.5, 0.52])
    ranges = np.array([1.0, 2.0, 3.0, 5.0, 4.0])
    uneven = Scan(0, bearings, ranges, np.zeros(5), BASE_FROM_LASER, 10.0)
    first, increment, even = as_even_beams(uneven)
    assert first == 0.0
    assert increment == pytest.approx(0.105)
    np.testing.assert_array_equal(even, np.array([1.0, 2.0, 3.0, np.nan, np.nan, 4.0], dtype=np.float32))
