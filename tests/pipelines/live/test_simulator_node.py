"""The simulated car as a node: what it publishes, and what it makes of whatever is sent to it."""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from racecar.maps.geometry.se2 import Pose, between
from racecar.pipelines.bags.messages import TRANSFORMS, nanoseconds, ros2_types
from racecar.pipelines.simulation.driven_simulation import Conditions, DrivenSimulation
from racecar.pipelines.simulation.simulator_config import NoiseLevel
from tests.pipelines.live.simulated_driver import Driver
from tests.pipelines.live.stage import wait_for
from tests.pipelines.simulation.test_driven_simulation import GRID

START = np.array([2.0, 2.0, 0.0])
NAMESPACE, PACE = "/car1", 2.0


@dataclass
class Stage:
    """The node under test, and who drives it."""

    simulator: Any
    driver: Driver
    log: list[str]

    def say_initial_pose(self, place: Pose, frame: str = "map") -> None:
        from geometry_msgs.msg import PoseWithCovarianceStamped

        from racecar.pipelines.live.ros.messages import fill_pose

        message = PoseWithCovarianceStamped()
        message.header.frame_id = frame
        fill_pose(message.pose.pose, place)
        self.driver.say("initialpose", message)

    def carry_to(self, place: Pose) -> None:
        self.say_initial_pose(place)
        wait_for(lambda: self.driver.distance_to(place) < 0.01, self.said, 3.0)

    def await_arrival(self, goal: Pose) -> None:
        wait_for(lambda: self.driver.distance_to(goal) < 0.3 and self.driver.speed == 0.0, self.said, 30.0)

    def await_words(self, words: str) -> None:
        wait_for(lambda: words in self.said(), self.said, 5.0)

    def said(self) -> str:
        return "\n".join(self.log)


@pytest.fixture(scope="module")
def stage() -> Iterator[Stage]:
    from racecar.pipelines.live.simulator_node import SimulatorNode
    from tests.pipelines.live.bus import ros_bus

    simulation = DrivenSimulation(GRID, Conditions(noise=NoiseLevel.NONE), start=START)
    with ros_bus() as bus:
        node = bus.node("racecar_simulator", "-r", f"__ns:={NAMESPACE}")
        stage = Stage(
            SimulatorNode(node, simulation, pace=PACE, teleports=True),
            Driver(bus.node("test_driver"), NAMESPACE),
            bus.log,
        )
        stage.simulator.start()
        wait_for(lambda: bool(stage.driver.truth), stage.said, 1.0)
        yield stage


def test_scans_odometry_frames_and_time_agree(stage: Stage) -> None:
    from nav_msgs.msg import Odometry as OdometryMessage
    from rosgraph_msgs.msg import Clock
    from sensor_msgs.msg import LaserScan

    from racecar.pipelines.live.ros.message_types import transform_message_type
    from racecar.pipelines.live.ros.qos import LATCHED

    scans: list[Any] = []
    odometry: list[Any] = []
    clocks: list[int] = []
    links: dict[tuple[str, str], int] = {}

    def on_link(serialized: bytes) -> None:
        for each in ros2_types().deserialize_cdr(serialized, TRANSFORMS).transforms:
            links[each.header.frame_id, each.child_frame_id] = nanoseconds(each.header.stamp)

    node = stage.driver.node
    node.create_subscription(LaserScan, "/car1/scan", scans.append, 100)
    node.create_subscription(OdometryMessage, "/car1/odom", odometry.append, 100)
    node.create_subscription(Clock, "/car1/clock", lambda each: clocks.append(nanoseconds(each.clock)), 100)
    node.create_subscription(transform_message_type(), "/tf", on_link, 100, raw=True)
    node.create_subscription(transform_message_type(), "/tf_static", on_link, LATCHED, raw=True)
    wait_for(lambda: len(scans) > 10 and len(clocks) > 25 and len(links) > 1, lambda: f"{links}", 10.0)
    assert set(links) == {("car1/odom", "car1/base_link"), ("car1/base_link", "car1/laser")}
    assert (scans[0].header.frame_id, len(scans[0].ranges)) == ("car1/laser", 1081)
    assert (odometry[0].header.frame_id, odometry[0].child_frame_id) == ("car1/odom", "car1/base_link")
    stamps = np.array([nanoseconds(each.header.stamp) for each in scans])
    np.testing.assert_array_equal(np.diff(stamps), 50_000_000)
    np.testing.assert_array_equal(np.diff(clocks), 20_000_000)
    told = {nanoseconds(each.header.stamp) for each in odometry}
    wait_for(lambda: told <= set(stage.driver.truth), lambda: f"{told - set(stage.driver.truth)}", 10.0)
    assert abs(stage.driver.place[0] - START[0]) < 0.1


def test_a_goal_is_driven_to_and_its_heading_counts(stage: Stage) -> None:
    goal = np.array([6.0, 3.0, -np.pi / 2])
    stage.driver.send_goal(goal)
    stage.await_arrival(goal)
    assert abs(between(stage.driver.place, goal)[2]) < 0.3


def test_a_goal_may_be_given_as_seen_from_the_car(stage: Stage) -> None:
    before = stage.driver.place
    stage.driver.send_goal(np.array([1.0, 0.0, 0.0]), "car1/base_link")
    wait_for(lambda: abs(between(before, stage.driver.place)[0] - 1.0) < 0.3, stage.said, 20.0)


def test_a_goal_lies_where_whoever_publishes_its_map_says(stage: Stage) -> None:
    from racecar.pipelines.live.ros.message_types import transform_message_type
    from racecar.pipelines.live.ros.messages import transform_bytes

    # A mapper's map begins where the car was, so its frame is not that of the simulated map: with true wheels
    # the odometry's frame lies at START in the one, and at the origin in the other.
    publisher = stage.driver.node.create_publisher(transform_message_type(), "/tf", 10)
    wait_for(lambda: publisher.get_subscription_count() > 1, lambda: "nobody listens to /tf", 10.0)
    mapped = "mapped"
    links = stage.simulator._goals._links
    until = time.monotonic() + 10.0
    while links.frame_from_odom(mapped) is None:
        assert time.monotonic() < until
        publisher.publish(transform_bytes(time.time_ns(), mapped, "car1/odom", np.zeros(3)))
        time.sleep(0.1)
    goal = np.array([2.0, 3.5, 0.0])
    stage.driver.send_goal(goal - START, mapped)
    stage.await_arrival(goal)


@pytest.mark.parametrize(
    ("goal", "frame", "words"),
    [
        ([30.0, 3.0, 0.0], "map", "The goal is left out. The car cannot get there"),
        ([4.0, 1.5, 0.0], "map", "The car cannot stand at the goal"),
        ([np.nan, 3.0, 0.0], "map", "position or its quaternion is not valid"),
        ([2.0, 3.0, 0.0], "moon", "Its frame moon is not known"),
    ],
)
def test_a_goal_that_cannot_be_reached_gets_a_sentence(
    stage: Stage, goal: list[float], frame: str, words: str
) -> None:
    stage.log.clear()
    time.sleep(0.25)  # so that it is not the same fault in other words, of which not all are logged
    stage.driver.send_goal(np.array(goal), frame)
    stage.await_words(words)
    assert "fault in racecar" not in stage.said()


def test_the_car_is_driven_by_velocity_and_stops_when_commands_stop(stage: Stage) -> None:
    driver = stage.driver
    stage.carry_to(START)
    stage.log.clear()
    driver.command(0.6, 0.5, 1.0)
    moved = between(START, driver.place)
    assert moved[0] > 0.2
    assert moved[2] > 0.1
    stage.await_words("Commands have stopped coming on /car1/cmd_vel: the car brakes.")
    wait_for(lambda: driver.speed == 0.0, lambda: f"{driver.speed} m/s", 2.0)


def test_the_car_is_driven_by_steering_angle(stage: Stage) -> None:
    stage.carry_to(START)
    stage.log.clear()
    stage.driver.command_steering(0.6, -0.3, 1.0)
    moved = between(START, stage.driver.place)
    assert moved[0] > 0.2
    assert moved[2] < -0.1
    stage.await_words("Commands have stopped coming on /car1/drive: the car brakes.")


def test_a_command_takes_the_wheel_from_a_goal(stage: Stage) -> None:
    stage.carry_to(START)
    stage.driver.send_goal(np.array([6.0, 3.0, 0.0]))
    wait_for(lambda: abs(stage.driver.speed) > 0.3, stage.said, 10.0)
    stage.driver.command(0.0, 0.0, 0.2, is_stamped=True)
    wait_for(lambda: stage.driver.speed == 0.0, lambda: "it drives on", 3.0)
    assert not stage.simulator._simulation.is_underway


def test_a_car_that_does_not_get_on_is_told_of(stage: Stage) -> None:
    stage.carry_to(START)
    stage.driver.send_goal(np.array([6.0, 3.0, 0.0]))
    wait_for(lambda: abs(stage.driver.speed) > 0.3, stage.said, 10.0)
    simulation = stage.simulator._simulation
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(simulation, "_is_someone_ahead", lambda speed: True)
        stage.await_words("stands still on its way")
    wait_for(lambda: stage.driver.speed > 0.3, lambda: "it waits on", 10.0)


def test_commands_that_no_car_can_follow_get_a_sentence(stage: Stage) -> None:
    stage.log.clear()
    stage.driver.command(np.nan, 0.0, 0.1)
    stage.await_words("not a finite number")
    stage.driver.command(1.0, np.inf, 0.1)
    stage.driver.command(1e30, 0.0, 0.3)
    stage.await_words("ask for more than the car's 2 m/s")
    assert abs(stage.driver.speed) <= 2.0
    stage.driver.command(0.0, 1e308, 0.1)
    assert "fault in racecar" not in stage.said()


def test_the_world_changes_while_the_car_drives(stage: Stage) -> None:
    from rclpy.parameter import Parameter

    node, simulation = stage.simulator.node, stage.simulator._simulation
    (answer,) = node.set_parameters([Parameter("walkers", value=3)])
    assert answer.successful
    wait_for(lambda: len(simulation.legs) == 6, lambda: "nobody walks", 3.0)
    (answer,) = node.set_parameters([Parameter("noise", value="awful")])
    assert not answer.successful
    assert "awful" in answer.reason
    node.set_parameters([Parameter("walkers", value=0)])


def test_the_names_of_a_car_are_in_its_namespace(stage: Stage) -> None:
    names = {name for name, _ in stage.driver.node.get_topic_names_and_types()}
    own = {"scan", "odom", "ground_truth", "clock", "cmd_vel", "goal_pose", "initialpose"}
    assert {f"/car1/{name}" for name in own} <= names
    assert not {f"/{name}" for name in own} & names


def test_the_car_is_carried_to_where_it_fits(stage: Stage) -> None:
    place = np.array([6.5, 4.5, 1.0])
    stage.carry_to(place)
    stage.say_initial_pose(np.array([40.0, 4.5, 1.0]))
    stage.await_words("does not fit")
    time.sleep(0.25)
    stage.say_initial_pose(place, "odom")
    stage.await_words("give it in map, not in odom")
