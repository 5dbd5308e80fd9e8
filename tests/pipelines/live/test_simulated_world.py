"""A simulated car, a localizer and a mapper, each a process, and somebody who sends goals: all over DDS."""

import os
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from racecar.maps.geometry.se2 import Pose, compose, inverse, transform_points
from racecar.maps.grid.distance_field import distance_to_occupied, sample_field
from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM
from racecar.maps.map_files import load_map, save_map
from racecar.pipelines.bags.converters.odometry import planar_pose
from racecar.pipelines.bags.messages import nanoseconds
from tests.pipelines.live.live_car import ring
from tests.pipelines.live.simulated_driver import Driver
from tests.pipelines.live.stage import wait_for

START = np.array([0.3, 0.12, 0.1])
GOALS = [np.array([2.8, 2.0, np.pi / 2]), np.array([-0.5, 4.0, np.pi]), np.array([-2.8, 2.0, -np.pi / 2])]
"""Round the block in the middle; the last is given on the map that is being drawn."""
ARRIVED, LOCALIZED = 0.3, 0.02
"""Metres: from a goal, and of the localizer's mean error."""


def test_the_car_arrives_at_every_goal_and_is_localized_and_mapped_all_the_way(tmp_path: Path) -> None:
    from geometry_msgs.msg import PoseStamped
    from nav_msgs.msg import Odometry as OdometryMessage

    from racecar.pipelines.live.ros.processes import private_environment, racecar_process
    from racecar.pipelines.live.ros.run import ros_node, served

    log, plan, out = tmp_path / "log", tmp_path / "plan" / "map.yaml", tmp_path / "out"
    plan.parent.mkdir()
    save_map(ring(), plan)
    environment = private_environment(int(os.environ["ROS_DOMAIN_ID"]))
    pose = [str(value) for value in START]
    poses: dict[int, Pose] = {}
    mapped: list[Any] = []

    def hear(message: Any) -> None:
        pose = planar_pose(message)
        assert pose is not None
        poses[nanoseconds(message.header.stamp)] = pose

    def said() -> str:
        return f"the car is at {driver.place}; {log.read_text()[-3000:]}"

    with ros_node("test_driver", []) as node, ExitStack() as processes:

        def run(*arguments: str) -> None:
            processes.enter_context(racecar_process(["live", *arguments], environment, log))

        driver = Driver(node)
        node.create_subscription(PoseStamped, "/tracked_pose", mapped.append, 10)
        node.create_subscription(OdometryMessage, "/pf/pose/odom", hear, 1000)
        processes.enter_context(served(node))
        run("simulate", "--map", str(plan), "--start", *pose, "--seed", "1")
        run("localize", "--map", str(plan), "--initial-pose", *pose, "--no-memory")
        run("map", "--out", str(out), "--ros-args", "-p", "map_frame:=mapped")
        wait_for(lambda: bool(driver.truth and poses and mapped), log.read_text, 400.0)
        assert node.count_subscribers("/initialpose") == 1  # of the localizer; nobody is carried by it
        poses.clear()
        for goal, frame in zip(GOALS, ("map", "map", "mapped"), strict=True):
            driver.send_goal(goal if frame == "map" else compose(inverse(START), goal), frame)
            wait_for(
                lambda goal=goal: driver.distance_to(goal) < ARRIVED and driver.speed == 0.0, said, 200.0
            )
        known = [(pose, driver.truth[stamp]) for stamp, pose in list(poses.items()) if stamp in driver.truth]
    errors = [np.hypot(*(pose - truth)[:2]) for pose, truth in known]
    print(f"{len(errors)} poses, mean error {1e3 * np.mean(errors):.1f} mm")
    assert len(errors) > 300
    assert np.mean(errors) < LOCALIZED, log.read_text()
    drawn = load_map(out)
    seen = drawn.center_of(np.argwhere(drawn.cells >= OCCUPIED_FROM))
    walls = transform_points(START, seen)  # the mapper's map begins where the car did
    assert len(walls) > 300
    assert np.mean(sample_field(distance_to_occupied(ring()), ring(), walls) < 0.1) > 0.95
