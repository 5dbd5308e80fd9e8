"""A localizer's node drives with a simulated car and lives through all that goes wrong, in this order.

Each test leaves the car driving and the node right about where it is.
"""

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from racecar.maps.geometry.se2 import Pose, compose, inverse
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.bags.messages import nanoseconds
from tests.pipelines.live.live_car import recorded, ring, wait_for
from tests.pipelines.live.localizer_stage import RIGHT_AGAIN, Stage, localizer_stage, map_message


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stage]:
    with localizer_stage(tmp_path_factory.mktemp("live")) as stage:
        yield stage


def initial_pose(pose: Pose) -> Any:
    from racecar.pipelines.live.ros.messages import pose_message, time_message

    return pose_message(time_message(time.time_ns()), "map", pose, np.diag([0.04, 0.04, 0.01]))


def test_first_pose_comes_soon_and_is_right(stage: Stage) -> None:
    wait_for(lambda: bool(stage.witness.odometry), 2.0, stage.witness.said)
    stage.witness.seconds_until_right(RIGHT_AGAIN)


def test_the_log_says_when_it_is_ready_and_where_the_car_is_found(stage: Stage) -> None:
    wait_for(lambda: "Found: the car is at x " in stage.log.read_text(), 6.0, stage.witness.said)
    log = stage.log.read_text()
    assert log.index("Ready: each scan is now laid on a map of ") < log.index("Found: the car is at x ")
    wait_for(
        lambda: stage.witness.figure("drive so far") in ("localized", "uncertain"), 6.0, stage.witness.said
    )  # which of both depends on how far the car has come by now


def test_every_scan_has_a_pose_and_every_odometry_message_too(stage: Stage) -> None:
    car, witness = stage.car, stage.witness
    scans, samples, poses, outputs = (
        car.scans_sent,
        car.odometry_sent,
        len(witness.poses),
        len(witness.odometry),
    )
    time.sleep(2.0)
    assert len(witness.poses) - poses == pytest.approx(car.scans_sent - scans, abs=2)
    assert len(witness.odometry) - outputs == pytest.approx(car.odometry_sent - samples, abs=2)
    assert max(witness.error(heard) for heard in witness.odometry[-80:]) < 0.15
    assert max(witness.error(heard) for heard in witness.poses[-60:]) < 0.1


def test_map_to_odometry_leads_to_the_car(stage: Stage) -> None:
    witness = stage.witness
    parent, child, heard = witness.transforms[-1]
    assert (parent, child) == ("map", "odom")
    # What is published holds a little longer than the moment it was measured at.
    stamp = heard.stamp - 100_000_000
    said = {due: sample for due, sample, _ in recorded() if isinstance(sample, tuple)}
    offset = min(stamp - due for due in said if abs(stage.car.truth[stamp][0] - truth_of(due)[0]) < 1e-9)
    measured = said[stamp - offset][0].odom_from_base
    missed = compose(inverse(compose(heard.pose, measured)), stage.car.truth[stamp])
    assert np.hypot(missed[0], missed[1]) + abs(missed[2]) < 0.15


def truth_of(due: int) -> Pose:
    return next(truth for when, _, truth in recorded() if when == due)


def test_scans_stop_for_five_seconds(stage: Stage) -> None:
    before = len(stage.witness.warnings("Nothing arrives on /scan any more"))
    stage.car.scans_on = False
    stage.witness.await_diagnosis("Nothing arrives on /scan any more")
    time.sleep(3.0)
    assert time.monotonic() - stage.witness.odometry[-1].at < 0.2  # carried on by odometry
    stage.car.scans_on = True
    stage.witness.seconds_until_right(RIGHT_AGAIN)
    assert len(stage.witness.warnings("Nothing arrives on /scan any more")) == before + 1
    wait_for(lambda: "Messages arrive on /scan." in stage.log.read_text(), 2.0, stage.witness.said)


def test_odometry_stops(stage: Stage) -> None:
    before = len(stage.witness.warnings("Nothing arrives on /odom any more"))
    stage.car.odometry_on = False
    stage.witness.await_diagnosis("Nothing arrives on /odom any more")
    stage.witness.seconds_until_right(RIGHT_AGAIN)  # poses go on, at the rate of the scans
    stage.car.odometry_on = True
    stage.witness.seconds_until_right(RIGHT_AGAIN)
    assert len(stage.witness.warnings("Nothing arrives on /odom any more")) == before + 1


@pytest.mark.parametrize("seconds", [-10, 3600, -3590])
def test_stamps_jump(stage: Stage, seconds: int) -> None:
    sentence = f"The stamps of the scans jumped by {'+' if seconds > 0 else '-'}"  # give or take a delay
    before = len(stage.witness.warnings(sentence))
    stage.car.shift += seconds * 10**9
    stage.witness.await_diagnosis(sentence)
    stage.witness.seconds_until_right(RIGHT_AGAIN)
    assert len(stage.witness.warnings(sentence)) == before + 1


def test_scans_of_nothing_but_nan(stage: Stage) -> None:
    def blind(message: Any) -> None:
        message.ranges = [float("nan")] * len(message.ranges)

    stage.car.spoil = blind
    stage.witness.await_diagnosis("The scans hold no readings")
    stage.car.spoil = lambda message: None
    stage.witness.seconds_until_right(RIGHT_AGAIN)
    assert len(stage.witness.warnings("The scans hold no readings")) == 1


def test_the_number_of_beams_changes(stage: Stage) -> None:
    def halve(message: Any) -> None:
        message.ranges = message.ranges[::2]
        message.angle_increment *= 2.0
        message.time_increment *= 2.0

    stage.car.spoil = halve
    stage.witness.await_diagnosis("number of beams changed to 541")
    stage.witness.seconds_until_right(RIGHT_AGAIN)
    stage.car.spoil = lambda message: None
    stage.witness.seconds_until_right(RIGHT_AGAIN)


def test_an_initial_pose_outside_the_map_is_refused(stage: Stage) -> None:
    from geometry_msgs.msg import PoseWithCovarianceStamped

    topic = stage.publisher(PoseWithCovarianceStamped, "/initialpose")
    topic.publish(initial_pose(np.array([500.0, 500.0, 0.0])))
    stage.witness.await_diagnosis("is not on the map's free space")
    stage.witness.seconds_until_right(RIGHT_AGAIN)
    topic.publish(initial_pose(np.array([np.nan, 0.0, 0.0])))
    stage.witness.await_diagnosis("The initial pose is left out")
    stage.witness.seconds_until_right(RIGHT_AGAIN)


def test_of_two_initial_poses_at_once_the_later_counts(stage: Stage) -> None:
    from geometry_msgs.msg import PoseWithCovarianceStamped

    topic = stage.publisher(PoseWithCovarianceStamped, "/initialpose")
    wrong = compose(stage.car.place, np.array([-1.0, 0.3, 1.5]))
    topic.publish(initial_pose(wrong))
    topic.publish(initial_pose(stage.car.place))
    stage.witness.seconds_until_right(RIGHT_AGAIN)


def test_floods_are_lived_through(stage: Stage) -> None:
    from geometry_msgs.msg import PoseWithCovarianceStamped

    topic = stage.publisher(PoseWithCovarianceStamped, "/initialpose")
    stage.car.scans_per_sweep = 20
    for _ in range(200):
        topic.publish(initial_pose(stage.car.place))
        time.sleep(0.005)
    stage.car.scans_per_sweep = 1
    stage.witness.seconds_until_right(RIGHT_AGAIN)


def test_a_clicked_point_and_a_global_search_find_the_car(stage: Stage) -> None:
    from geometry_msgs.msg import Point, PointStamped
    from std_srvs.srv import Empty

    from racecar.pipelines.live.ros.messages import header, time_message

    topic = stage.publisher(PointStamped, "/clicked_point")
    x, y, _ = stage.car.place
    topic.publish(
        PointStamped(header=header(time_message(time.time_ns()), "map"), point=Point(x=float(x), y=float(y)))
    )
    wait_for(lambda: "Searching for the car near" in stage.log.read_text(), 2.0, stage.witness.said)
    stage.witness.seconds_until_right(4.0)
    client = stage.node.create_client(Empty, "/reinitialize_global_localization")
    assert client.wait_for_service(5.0)
    client.call_async(Empty.Request())
    wait_for(lambda: "on the whole map" in stage.log.read_text(), 2.0, stage.witness.said)
    stage.witness.seconds_until_right(4.0)


def test_what_people_look_at_comes_when_they_listen(stage: Stage) -> None:
    from geometry_msgs.msg import PoseArray
    from nav_msgs.msg import Path as PathMessage
    from rclpy.qos import qos_profile_sensor_data
    from sensor_msgs.msg import PointCloud2

    from racecar.pipelines.live.ros.qos import LATCHED

    heard: dict[str, list[Any]] = {"particle_cloud": [], "scan_on_map": [], "path": []}
    for (topic, messages), (kind, qos) in zip(
        heard.items(),
        [(PoseArray, 10), (PointCloud2, qos_profile_sensor_data), (PathMessage, LATCHED)],
        strict=True,
    ):
        stage.node.create_subscription(kind, f"/{topic}", messages.append, qos)
    wait_for(lambda: all(len(messages) > 1 for messages in heard.values()), 5.0, lambda: str(heard.keys()))
    newest = heard["particle_cloud"][-1]
    x, y, _ = stage.car.truth[nanoseconds(newest.header.stamp)]
    particles = np.array([[pose.position.x, pose.position.y] for pose in newest.poses])
    assert len(particles) >= 100
    assert np.hypot(*(np.median(particles, axis=0) - [x, y])) < 1.0
    cloud = heard["scan_on_map"][-1]
    points = np.frombuffer(bytes(cloud.data), dtype="<f4").reshape(-1, 3)[:, :2]
    near_walls = np.concatenate(
        [points + step for step in 0.05 * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])]
    )
    cells = ring().cell_of(near_walls)
    on_wall = (ring().cells[tuple(np.clip(cells, 0, np.array(ring().cells.shape) - 1).T)] > 50).reshape(5, -1)
    assert on_wall.any(axis=0).mean() > 0.9
    assert len(heard["path"][-1].poses) > 10
    assert heard["path"][-1].poses[-1].header.frame_id == "map"


def test_settings_change_while_running(stage: Stage) -> None:
    from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
    from rcl_interfaces.srv import SetParameters

    client = stage.node.create_client(SetParameters, "/racecar_localizer/set_parameters")
    assert client.wait_for_service(5.0)

    def ask(value: int) -> Any:
        told = ParameterValue(type=ParameterType.PARAMETER_INTEGER, integer_value=value)
        future = client.call_async(
            SetParameters.Request(parameters=[Parameter(name="particles", value=told)])
        )
        wait_for(future.done, 5.0, stage.witness.said)
        return future.result().results[0]

    refused = ask(-3)
    assert not refused.successful
    assert "particles" in refused.reason
    assert ask(1500).successful
    stage.witness.seconds_until_right(RIGHT_AGAIN)
    wait_for(lambda: 0 < int(stage.witness.figure("particles") or 0) <= 1500, 4.0, stage.witness.said)


def test_a_map_of_another_size_is_taken_while_driving(stage: Stage) -> None:
    from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage

    from racecar.pipelines.live.ros.qos import LATCHED

    topic = stage.publisher(OccupancyGridMessage, "/map", LATCHED)
    wider = OccupancyGrid(
        np.pad(ring().cells, ((20, 0), (40, 7)), constant_values=-1),
        ring().resolution,
        compose(ring().map_from_grid, np.array([-40.0, -20.0, 0.0]) * ring().resolution),
    )
    broken = map_message(ring())
    broken.info.width += 1
    topic.publish(broken)
    stage.witness.await_diagnosis("do not make a map")
    topic.publish(map_message(wider))
    stage.witness.await_diagnosis("Another map has arrived")
    stage.witness.seconds_until_right(RIGHT_AGAIN)
