"""A localizer and a mapper that nav2's lifecycle manager brings up and down over DDS, while a car drives."""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecar.maps.geometry.se2 import Pose, between
from racecar.maps.map_files import load_map
from racecar.pipelines.bags.converters.odometry import planar_pose, pose_in_plane
from racecar.pipelines.bags.messages import nanoseconds
from tests.pipelines.live.lifecycle_manager import (
    ACTIVATE,
    ACTIVE,
    CLEANUP,
    CONFIGURE,
    DEACTIVATE,
    FINALIZED,
    INACTIVE,
    SHUTDOWN,
    UNCONFIGURED,
    Manager,
    manager_of,
)
from tests.pipelines.live.live_car import LiveCar

_LONG = 160.0
"""Seconds of driving."""
_WITHIN = 2.0
"""Seconds after the activation."""
MANAGED = ["--ros-args", "-p", "use_lifecycle_manager:=true"]


@dataclass
class Drive:
    """A car, the manager of its node, and the poses that are heard."""

    car: LiveCar
    manager: Manager
    poses: list[tuple[float, int, Pose]] = field(default_factory=list)
    """When, at which stamp, and where."""

    def wait_for(self, condition: Callable[[], bool], seconds: float) -> None:
        until = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < until
            time.sleep(0.01)

    def seconds_to_a_right_pose(self, began: float) -> float:
        """From then to the first of the poses that are where the car is."""
        until = began + 30.0
        while time.monotonic() < until:
            for at, stamp, pose in [*self.poses]:
                truth = self.car.truth.get(stamp)
                if at > began and truth is not None and np.hypot(*between(truth, pose)[:2]) < 0.2:
                    return at - began
            time.sleep(0.01)
        raise AssertionError([(stamp, pose, self.car.truth.get(stamp)) for _, stamp, pose in self.poses[-3:]])

    def endpoints(self, name: str) -> int:
        """Number of DDS readers and writers of a node's topics and services."""
        node = self.car.node
        return sum(
            each.node_name == name
            for topic, _ in node.get_topic_names_and_types(no_demangle=True)
            for ask in (node.get_publishers_info_by_topic, node.get_subscriptions_info_by_topic)
            for each in ask(topic, no_mangle=True)
        )

    def assert_silence(self) -> None:
        time.sleep(0.2)  # for what is under way
        self.poses.clear()
        time.sleep(0.4)
        assert not self.poses


@contextmanager
def drive_of(name: str, topic: str, kind: Any, seconds: float) -> Iterator[Drive]:
    """ROS must run."""
    import rclpy

    from racecar.pipelines.live.ros.run import served

    node = rclpy.create_node("test_car")
    try:
        with manager_of(name) as manager, served(node):
            drive = Drive(LiveCar(node), manager)

            def hear(message: Any) -> None:
                pose = (
                    pose_in_plane(message.pose) if hasattr(message.pose, "position") else planar_pose(message)
                )
                assert pose is not None
                drive.poses.append((time.monotonic(), nanoseconds(message.header.stamp), pose))

            node.create_subscription(kind, topic, hear, 100)
            with drive.car.driving(seconds):
                yield drive
    finally:
        node.destroy_node()


@contextmanager
def localizer_drive(seconds: float) -> Iterator[Drive]:
    from nav_msgs.msg import Odometry

    with drive_of("racecar_localizer", "/pf/pose/odom", Odometry, seconds) as drive:
        yield drive


@contextmanager
def process(arguments: list[str], log: Path) -> Iterator[int]:
    """Its number; it must end well."""
    from racecar.pipelines.live.ros.processes import private_environment, racecar_process

    environment = private_environment(int(os.environ["ROS_DOMAIN_ID"]))
    with racecar_process(arguments, environment, log) as running:
        yield running.pid
    assert running.returncode == 0, log.read_text()


def usage(pid: int) -> tuple[int, int, int]:
    """Threads, open files, and MB of memory."""
    status = dict(line.split(":", 1) for line in Path(f"/proc/{pid}/status").read_text().splitlines())
    files = len(list(Path(f"/proc/{pid}/fd").iterdir()))
    return int(status["Threads"]), files, int(status["VmRSS"].split()[0]) // 1024


@pytest.mark.slow
def test_a_localizer_is_brought_up_and_reset_twice(tmp_path: Path) -> None:
    from racecar.pipelines.files.config_file import Config
    from racecar.pipelines.live.localizer_node import LocalizerNode, LocalizerStart
    from racecar.pipelines.live.managed_node import ManagedNode
    from racecar.pipelines.live.ros.run import ros_node, served

    def create(node: Any, _is_first: bool) -> LocalizerNode:
        return LocalizerNode(node, Config(), LocalizerStart(load_map("ring"), memory=tmp_path))

    with (
        ros_node("racecar_localizer", MANAGED, lambda name: ManagedNode(name, create)) as node,
        served(node),
        localizer_drive(110.0) as drive,
    ):
        manager = drive.manager
        for _ in range(2):
            assert manager.startup()
            drive.seconds_to_a_right_pose(time.monotonic())
            assert manager.reset()
            assert manager.state == UNCONFIGURED
        drive.assert_silence()
        assert node.count_subscribers("/scan") == 0
        assert manager.change(SHUTDOWN)


@pytest.mark.slow
def test_twenty_rounds_of_a_localizer(tmp_path: Path) -> None:
    log, used = tmp_path / "log", []
    command = ["live", "localize", "--map", "ring", "--memory", str(tmp_path / "memory"), *MANAGED]
    from racecar.pipelines.live.ros.run import ros_node

    with process(command, log) as pid, ros_node("test", []), localizer_drive(_LONG) as drive:
        manager = drive.manager
        took: list[float] = []
        for turn in range(20):
            assert manager.startup(), log.read_text()
            took.append(drive.seconds_to_a_right_pose(time.monotonic()))
            if turn % 4 == 1:  # a pause
                assert manager.change(DEACTIVATE)
                drive.assert_silence()
                assert manager.change(ACTIVATE)
                took.append(drive.seconds_to_a_right_pose(time.monotonic()))
            if turn % 4 == 2:  # the bond is broken by the manager, who then resets the node
                manager.forget_bond()
                assert manager.state == ACTIVE
            if turn == 3:  # a manager that hangs is none of the node's business
                assert manager.bond is not None
                manager.bond.fall_silent()
                time.sleep(5.0)
                assert manager.state == ACTIVE
            assert manager.reset(), log.read_text()
            assert manager.state == UNCONFIGURED
            drive.assert_silence()
            used.append((*usage(pid), drive.endpoints("racecar_localizer")))
        assert max(took) < _WITHIN, took
        assert manager.startup()
        assert manager.shutdown()
        assert manager.state == FINALIZED
    warnings = [line for line in log.read_text().splitlines() if "[WARN]" in line]
    assert all("No transform says yet" in line for line in warnings), warnings
    threads, files, memory, endpoints = zip(*used, strict=True)
    assert set(threads[1:]) == {threads[-1]}, threads
    assert set(files[1:]) == {files[-1]}, files
    assert set(endpoints) == {endpoints[-1]}, endpoints
    assert memory[-1] - memory[4] < 20, memory


@pytest.mark.slow
def test_twenty_rounds_of_a_mapper(tmp_path: Path) -> None:
    from geometry_msgs.msg import PoseStamped

    from racecar.pipelines.live.ros.run import ros_node

    log, out, used = tmp_path / "log", tmp_path / "out", []
    with (
        process(["live", "map", "--out", str(out), *MANAGED], log) as pid,
        ros_node("test", []),
        drive_of("racecar_mapper", "/tracked_pose", PoseStamped, _LONG) as drive,
    ):
        manager = drive.manager
        assert manager.startup(), log.read_text()
        for turn in range(20):
            drive.wait_for(lambda: bool(drive.poses), 60.0)
            time.sleep(0.5)
            assert manager.change(DEACTIVATE)
            assert manager.state == INACTIVE
            drive.assert_silence()
            if turn % 5 == 4:
                assert manager.change(CLEANUP)
                assert (out / "map.yaml").is_file()
                assert manager.change(CONFIGURE)
            assert manager.change(ACTIVATE)
            used.append((*usage(pid), drive.endpoints("racecar_mapper")))
        assert manager.shutdown()
        assert manager.state == FINALIZED
    threads, files, _, endpoints = zip(*used, strict=True)
    assert max(threads[1:]) - min(threads[1:]) <= 1, threads
    assert max(files[1:]) - min(files[1:]) <= 1, files
    assert set(endpoints[1:]) == {endpoints[-1]}, endpoints
    assert not (tmp_path / "out.drive.log").exists()
