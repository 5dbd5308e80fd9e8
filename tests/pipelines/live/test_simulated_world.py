"""A simulated car, a localizer and a mapper, each a process, and somebody who clicks goals: all over DDS."""

import os
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecar.maps.geometry.se2 import Pose, compose, inverse, transform_points
from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM
from racecar.maps.map_files import load_map, save_map
from racecar.pipelines.bags.converters.odometry import planar_pose
from racecar.pipelines.bags.messages import nanoseconds
from tests.pipelines.live.live_car import ring
from tests.pipelines.live.simulated_driver import Driver
from tests.pipelines.live.stage import wait_for

START = np.array([0.3, 0.12, 0.1])
GOALS = [np.array([2.8, 2.0, np.pi / 2]), np.array([-0.5, 4.0, np.pi])]
"""Half round the block in the middle."""
ARRIVED, LOCALIZED = 0.3, 0.02
"""Metres: from a goal, and of the localizer's mean error."""


@dataclass
class World:
    """All who take part."""

    driver: Driver
    out: Path
    log: Path
    poses: dict[int, Pose] = field(default_factory=dict)
    """By the localizer, at their stamps."""
    mapper: ExitStack = field(default_factory=ExitStack)

    def said(self) -> str:
        return self.log.read_text()[-3000:]

    def drive_to(self, goal: Pose, true_goal: Pose, frame: str) -> None:
        """Until the car stands there."""
        self.driver.send_goal(goal, frame)
        wait_for(
            lambda: self.driver.distance_to(true_goal) < ARRIVED and self.driver.speed == 0.0,
            lambda: f"{self.driver.place}, not {true_goal}; {self.said()}",
            200.0,
        )


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    from geometry_msgs.msg import PoseStamped
    from nav_msgs.msg import Odometry as OdometryMessage

    from racecar.pipelines.live.ros.processes import private_environment, racecar_process
    from racecar.pipelines.live.ros.run import ros_node, served

    folder = tmp_path_factory.mktemp("world")
    log, plan = folder / "log", folder / "plan" / "map.yaml"
    log.touch()
    plan.parent.mkdir()
    save_map(ring(), plan)
    environment = private_environment(int(os.environ["ROS_DOMAIN_ID"]))
    pose = [str(value) for value in START]
    simulate = ["live", "simulate", "--map", str(plan), "--start", *pose, "--seed", "1"]
    localize = ["live", "localize", "--map", str(plan), "--initial-pose", *pose, "--no-memory"]
    mapping = ["live", "map", "--out", str(folder / "out"), "--ros-args", "-p", "map_frame:=mapped"]
    with ros_node("test_driver", []) as node, ExitStack() as processes:
        world = World(Driver(node), folder / "out", log)

        def hear(message: Any) -> None:
            pose = planar_pose(message)
            assert pose is not None
            world.poses[nanoseconds(message.header.stamp)] = pose

        mapped: list[Any] = []
        node.create_subscription(PoseStamped, "/tracked_pose", mapped.append, 10)
        node.create_subscription(OdometryMessage, "/pf/pose/odom", hear, 1000)
        processes.enter_context(served(node))
        processes.enter_context(racecar_process(simulate, environment, log))
        processes.enter_context(racecar_process(localize, environment, log))
        processes.enter_context(world.mapper)
        world.mapper.enter_context(racecar_process(mapping, environment, log))
        wait_for(lambda: bool(world.driver.truth and world.poses and mapped), world.said, 400.0)
        yield world


def test_the_car_arrives_at_every_goal_and_is_localized_all_the_way(world: World) -> None:
    world.poses.clear()
    for goal in GOALS:
        world.drive_to(goal, goal, "map")
    errors = [
        np.hypot(*(pose - world.driver.truth[stamp])[:2])
        for stamp, pose in list(world.poses.items())
        if stamp in world.driver.truth
    ]
    print(f"{len(errors)} poses, mean error {1e3 * np.mean(errors):.1f} mm")
    assert len(errors) > 300
    assert np.mean(errors) < LOCALIZED, world.said()


def test_goals_on_the_map_that_is_being_drawn_are_where_they_are_shown(world: World) -> None:
    goal = np.array([-2.8, 2.0, -np.pi / 2])
    world.drive_to(compose(inverse(START), goal), goal, "mapped")


def test_stamped_velocities_drive_too_and_a_silent_commander_is_told(world: World) -> None:
    before = world.driver.place
    world.driver.command(0.5, 0.0, 2.0, is_stamped=True)
    wait_for(lambda: world.driver.distance_to(before) > 0.2, world.said)
    wait_for(lambda: "Commands have stopped coming on /cmd_vel" in world.said(), world.said)
    wait_for(lambda: world.driver.speed == 0.0, world.said)


def test_nobody_is_carried_by_what_the_localizer_is_told(world: World) -> None:
    assert world.driver.node.count_subscribers("/initialpose") == 1


def test_the_map_is_saved_at_the_end(world: World) -> None:
    world.mapper.close()
    drawn, plan = load_map(world.out), ring()
    seen = drawn.center_of(np.argwhere(drawn.cells >= OCCUPIED_FROM))
    walls = transform_points(START, seen)  # the mapper's map begins where the car did
    true_walls = plan.center_of(np.argwhere(plan.cells >= OCCUPIED_FROM))
    near = np.linalg.norm(walls[:, None] - true_walls[None], axis=2).min(axis=1)
    print(f"{len(walls)} cells, {np.mean(near < 0.1):.3f} of them near a wall")
    assert len(walls) > 300
    assert np.mean(near < 0.1) > 0.95
