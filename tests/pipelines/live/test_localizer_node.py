"""A localizer's node drives with a simulated car and does what it is asked, in this order.

Each test leaves the car driving and the node right about where it is.
"""

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecar.maps.geometry.se2 import compose, inverse
from racecar.maps.grid.distance_field import distance_to_occupied, sample_field
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.bags.messages import PARTICLE_CLOUD, nanoseconds, ros2_types
from tests.pipelines.live.live_car import recorded, ring
from tests.pipelines.live.stage import (
    Stage,
    car_stage,
    initial_pose,
    localizer_stage,
    map_message,
    wait_for,
)


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stage]:
    with localizer_stage(tmp_path_factory.mktemp("live")) as stage:
        yield stage


def test_first_pose_comes_soon_and_is_right(stage: Stage) -> None:
    wait_for(lambda: bool(stage.odometry), stage.said, 2.0)
    stage.await_right()


def test_the_log_says_when_it_is_ready_and_where_the_car_is_found(stage: Stage) -> None:
    stage.await_words("Found: the car is at x ")
    log = stage.bus.said
    assert log.index("Ready: each scan is now laid on a map of ") < log.index("Found: the car is at x ")
    # Which of both depends on how far the car has come by now.
    wait_for(lambda: stage.figure("drive so far") in ("localized", "uncertain"), stage.said, 6.0)


def test_every_scan_has_a_pose_and_every_odometry_message_too(stage: Stage) -> None:
    def counts() -> list[int]:
        return [stage.car.scans_sent, len(stage.poses), stage.car.odometry_sent, len(stage.odometry)]

    before = counts()
    time.sleep(2.0)
    scans, poses, samples, outputs = np.subtract(counts(), before)
    assert (poses, outputs) == (scans, samples)
    assert max(stage.errors(stage.odometry[-80:])) < 0.15
    assert max(stage.errors(stage.poses[-60:])) < 0.1


def test_map_to_odometry_leads_to_the_car(stage: Stage) -> None:
    parent, child, heard = stage.transforms[-1]
    assert (parent, child) == ("map", "odom")
    # What is published holds a little longer than the moment it was measured at.
    stamp = heard.stamp - 100_000_000
    said = [(sample[0], truth) for _, sample, truth in recorded() if isinstance(sample, tuple)]
    (sample,) = (sample for sample, truth in said if truth is stage.car.truth[stamp])
    missed = compose(inverse(compose(heard.pose, sample.odom_from_base)), stage.car.truth[stamp])
    assert np.hypot(missed[0], missed[1]) + abs(missed[2]) < 0.15


def test_who_asks_late_hears_the_last_pose_as_from_amcl(stage: Stage) -> None:
    from geometry_msgs.msg import PoseWithCovarianceStamped

    from racecar.pipelines.live.ros.qos import LATCHED

    stage.car.scans_on = False
    time.sleep(0.5)
    late = stage.hear("/amcl_pose", PoseWithCovarianceStamped, LATCHED)  # so does nav2_simple_commander
    wait_for(lambda: len(late) == 1, stage.said, 1.0)
    assert nanoseconds(late[0].header.stamp) == stage.poses[-1].stamp
    stage.car.scans_on = True
    stage.await_right()


def test_without_scans_odometry_carries_the_pose_on(stage: Stage) -> None:
    stage.car.scans_on = False
    time.sleep(5.0)
    assert time.monotonic() - stage.odometry[-1].at < 0.1
    assert stage.warnings("carried on by odometry alone") == 1
    stage.car.scans_on = True
    stage.await_right()
    stage.await_words("Messages arrive on /scan.")


def test_an_initial_pose_outside_the_map_is_refused(stage: Stage) -> None:
    for pose, words in (
        (np.array([500.0, 500.0, 0.0]), "is not on the map's free space"),
        (np.array([np.nan, 0.0, 0.0]), "The initial pose is left out"),
    ):
        stage.publish("/initialpose", initial_pose(pose))
        stage.await_diagnosis(words)
        stage.await_right()


def test_of_two_initial_poses_at_once_the_later_counts(stage: Stage) -> None:
    stage.publish("/initialpose", initial_pose(compose(stage.car.place, np.array([-1.0, 0.3, 1.5]))))
    stage.publish("/initialpose", initial_pose(stage.car.place))
    stage.await_right()


def test_a_clicked_point_and_global_localization_find_the_car(stage: Stage) -> None:
    from geometry_msgs.msg import Point, PointStamped
    from std_msgs.msg import Header
    from std_srvs.srv import Empty

    x, y, _ = stage.car.place.tolist()
    stage.publish("/clicked_point", PointStamped(header=Header(frame_id="map"), point=Point(x=x, y=y)))
    stage.await_words("Searching for the car near")
    stage.await_right(4.0)
    stage.bus.call("/reinitialize_global_localization", Empty.Request())
    stage.await_words("Global localization")
    stage.await_right(4.0)


def test_what_people_look_at_comes_when_they_listen(stage: Stage) -> None:
    from geometry_msgs.msg import PoseArray
    from nav_msgs.msg import Path as PathMessage
    from rclpy.qos import qos_profile_sensor_data
    from sensor_msgs.msg import PointCloud2

    from racecar.pipelines.live.ros.message_types import message_class
    from racecar.pipelines.live.ros.qos import LATCHED

    clouds = stage.hear("/scan_on_map", PointCloud2, qos_profile_sensor_data)
    swarms, paths = stage.hear("/pf/viz/particles", PoseArray), stage.hear("/path", PathMessage, LATCHED)
    weighed = stage.hear("/particle_cloud", message_class(PARTICLE_CLOUD), raw=True)
    wait_for(lambda: min(map(len, (clouds, swarms, weighed, paths))) > 1, stage.said, 5.0)
    x, y, _ = stage.car.truth[nanoseconds(swarms[-1].header.stamp)]
    particles = np.array([[pose.position.x, pose.position.y] for pose in swarms[-1].poses])
    assert len(particles) >= 100
    cloud = ros2_types().deserialize_cdr(weighed[-1], PARTICLE_CLOUD)
    assert np.isclose(sum(particle.weight for particle in cloud.particles), 1.0)
    assert cloud.particles[-1].pose.position.x == particles[-1][0]
    assert np.hypot(*(np.median(particles, axis=0) - [x, y])) < 1.0
    points = np.frombuffer(bytes(clouds[-1].data), dtype="<f4").reshape(-1, 3)[:, :2]
    assert np.mean(sample_field(distance_to_occupied(ring()), ring(), points) < 0.08) > 0.9
    assert len(paths[-1].poses) > 10
    assert paths[-1].poses[-1].header.frame_id == "map"


def test_settings_change_while_running(stage: Stage) -> None:
    from rclpy.parameter import Parameter

    def ask(value: int) -> Any:
        return stage.live.node.set_parameters([Parameter("particles", value=value)])[0]

    refused = ask(-3)
    assert not refused.successful
    assert "particles" in refused.reason
    assert ask(1500).successful
    stage.await_right()
    wait_for(lambda: 0 < int(stage.figure("particles") or 0) <= 1500, stage.said, 4.0)


def test_a_map_of_another_size_is_taken_while_driving(stage: Stage) -> None:
    from racecar.pipelines.live.ros.qos import LATCHED

    wider = OccupancyGrid(
        np.pad(ring().cells, ((20, 0), (40, 7)), constant_values=-1),
        ring().resolution,
        compose(ring().map_from_grid, np.array([-40.0, -20.0, 0.0]) * ring().resolution),
    )
    broken = map_message(ring())
    broken.info.width += 1
    stage.publish("/map", broken, LATCHED)
    stage.await_diagnosis("do not make a map")
    stage.publish("/map", map_message(wider), LATCHED)
    stage.await_diagnosis("Another map has arrived")
    stage.await_right()


def test_a_node_killed_mid_drive_is_right_two_seconds_after_its_first_scan(tmp_path: Path) -> None:
    """It begins where the car is by now, and knows its laser, which nobody tells it again."""
    with car_stage() as stage:
        stage.localize(tmp_path, initial_pose=recorded()[0][2])
        stage.car.drive()
        stage.await_right()
        time.sleep(2.0)
        stage.kill()
        stage.car.hush_place()
        time.sleep(3.0)
        stage.bus.log.clear()
        stage.localize(tmp_path)
        stage.await_right()
        assert "Global localization" not in stage.bus.said
        assert "where it was in the last run" in stage.bus.said
