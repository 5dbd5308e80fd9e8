"""A node on a bus, a simulated car that drives for it, and what is heard of both."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose, inverse
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.bags.converters.odometry import planar_pose, pose_in_plane
from racecar.pipelines.bags.messages import TRANSFORMS, nanoseconds, ros2_types
from racecar.pipelines.files.config_file import Config
from tests.pipelines.live.live_car import LiveCar, recorded, ring

if TYPE_CHECKING:
    from tests.pipelines.live.bus import Bus, BusNode

RIGHT_AGAIN = 2.0
"""Seconds of good input."""
_HANGS = 100.0
"""Seconds, after which whatever is waited for on a busy computer does not come any more."""


def wait_for(condition: Callable[[], bool], explain: Callable[[], str], within: float = _HANGS) -> None:
    """Ask again and again; fails the test after so many seconds, which pass in no time on a bus."""
    until = time.monotonic() + within
    while not condition():
        assert time.monotonic() < until, explain()
        time.sleep(0.02)


@dataclass
class Heard:
    """A pose that a node published."""

    at: float
    stamp: int
    pose: Pose


@dataclass
class Stage:
    """All of them; a localizer's map is the car's, and a mapper's begins where the car was first seen."""

    bus: "Bus"
    listener: "BusNode"
    car: LiveCar
    live: Any = None
    """The node under test."""
    odometry: list[Heard] = field(default_factory=list)
    """From a localizer."""
    poses: list[Heard] = field(default_factory=list)
    """Of the scans."""
    transforms: list[tuple[str, str, Heard]] = field(default_factory=list)
    statuses: list[Any] = field(default_factory=list)

    def __post_init__(self) -> None:
        from diagnostic_msgs.msg import DiagnosticArray
        from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
        from nav_msgs.msg import Odometry as OdometryMessage

        from racecar.pipelines.live.ros.message_types import transform_message_type

        listen = self.listener.create_subscription
        listen(OdometryMessage, "/pf/pose/odom", lambda said: self._hear(self.odometry, said), 100)
        listen(PoseWithCovarianceStamped, "/amcl_pose", lambda said: self._hear(self.poses, said), 100)
        listen(PoseStamped, "/tracked_pose", lambda said: self._hear(self.poses, said), 100)
        listen(DiagnosticArray, "/diagnostics", lambda said: self.statuses.extend(said.status), 10)
        listen(transform_message_type(), "/tf", self._hear_transforms, 100, raw=True)

    def localize(self, folder: Path, arguments: Sequence[str] = (), **start: Any) -> None:
        """Start a localizer with ROS arguments, which remembers poses in a folder."""
        node = self.bus.node("racecar_localizer", *arguments)
        self.live = localizer(node, **{"grid": ring(), "memory": folder, **start})
        self.live.start()

    def map(self, out: Path, *arguments: str) -> None:
        """Start a mapper with ROS arguments, or go on with what one that was killed has left."""
        self.live = mapper(self.bus.node("racecar_mapper", *arguments), out, announce=self.bus.log.append)
        self.live.start()

    def kill(self) -> None:
        """End the node without a word."""
        self.live.node.destroy_node()

    def publish(self, topic: str, message: Any, qos: Any = 10) -> None:
        """Say something that the car does not."""
        self.listener.create_publisher(type(message), topic, qos).publish(message)

    def hear(self, topic: str, kind: Any, qos: Any = 10, *, raw: bool = False) -> list[Any]:
        """What is published from now on, and before where it is kept for who comes late."""
        heard: list[Any] = []
        self.listener.create_subscription(kind, topic, heard.append, qos, raw=raw)
        return heard

    def await_words(self, *words: str, within: float = 6.0) -> None:
        """Until all of them are in the log."""
        wait_for(lambda: all(each in self.bus.said for each in words), self.said, within)

    def await_diagnosis(self, words: str, within: float = 6.0) -> None:
        """Until ``/diagnostics`` says something from now on."""
        self.statuses.clear()
        wait_for(lambda: any(words in status.message for status in self.statuses), self.said, within)

    def await_right(self, within: float = RIGHT_AGAIN, count: int = 10) -> None:
        """Until so many poses that came lately are where the car truly is."""
        since = time.monotonic()

        def is_right() -> bool:
            latest = [heard for heard in (self.odometry or self.poses)[-count:] if heard.at > since]
            return len(latest) == count and max(self.errors(latest)) < 0.15

        wait_for(is_right, self.said, within)

    def errors(self, heard: list[Heard]) -> list[float]:
        """Metres plus radians from the truth."""
        missed = [
            between(self.truth_at(each.stamp), compose(self.plan_from_map, each.pose)) for each in heard
        ]
        return [float(np.hypot(x, y) + abs(turn)) for x, y, turn in missed]

    @property
    def plan_from_map(self) -> Pose:
        """(3,)"""
        if self.odometry:
            return IDENTITY
        return compose(self.truth_at(self.poses[0].stamp), inverse(self.poses[0].pose))

    def truth_at(self, stamp: int) -> Pose:
        """Where the car truly was; a stamp that the node made or mended is some milliseconds off."""
        truth, by_time = self.car.truth.get(stamp), self.car.by_time
        return by_time[min(by_time, key=lambda each: abs(each - stamp))] if truth is None else truth

    def warnings(self, words: str) -> int:
        """How often the log warns of something."""
        return sum("[WARN]" in line and words in line for line in self.bus.log)

    def said(self) -> str:
        """The last lines of the log, and how far the last poses are off."""
        return "\n".join([*self.bus.log[-20:], str(self.errors(self.odometry[-5:] + self.poses[-5:]))])

    def figure(self, key: str) -> str | None:
        """The latest in ``/diagnostics``."""
        values = [value.value for status in self.statuses for value in status.values if value.key == key]
        return values[-1] if values else None

    def _hear(self, heard: list[Heard], message: Any) -> None:
        pose = pose_in_plane(message.pose) if hasattr(message.pose, "position") else planar_pose(message)
        assert pose is not None
        heard.append(Heard(time.monotonic(), nanoseconds(message.header.stamp), pose))

    def _hear_transforms(self, data: bytes) -> None:
        for each in ros2_types().deserialize_cdr(data, TRANSFORMS).transforms:
            place, turn = each.transform.translation, each.transform.rotation
            pose = np.array([place.x, place.y, 2 * np.arctan2(turn.z, turn.w)])
            heard = Heard(time.monotonic(), nanoseconds(each.header.stamp), pose)
            self.transforms.append((each.header.frame_id, each.child_frame_id, heard))


@contextmanager
def car_stage(prepare: Callable[[LiveCar], None] = lambda car: None) -> Iterator[Stage]:
    """A car, which is prepared before, and no node yet."""
    from tests.pipelines.live.bus import ros_bus

    with ros_bus() as bus:
        listener = bus.node("test_car")
        stage = Stage(bus, listener, LiveCar(listener))
        prepare(stage.car)
        yield stage


@contextmanager
def localizer_stage(folder: Path, prepare: Callable[[LiveCar], None] = lambda car: None) -> Iterator[Stage]:
    """A localizer that is sent its map and told where the car is, which drives."""
    with car_stage(prepare) as stage:
        from racecar.pipelines.live.ros.qos import LATCHED

        stage.publish("/map", map_message(ring()), LATCHED)
        stage.localize(folder, grid=None, initial_pose=recorded()[0][2])
        stage.await_words("The map has arrived")
        stage.car.drive()
        yield stage


@contextmanager
def mapper_stage(folder: Path, prepare: Callable[[LiveCar], None] = lambda car: None) -> Iterator[Stage]:
    """A mapper of a car that drives."""
    with car_stage(prepare) as stage:
        stage.map(folder / "out")
        stage.car.drive()
        yield stage


def localizer(node: "BusNode", view: Any = None, **start: Any) -> Any:
    """A node that is not started yet."""
    from racecar.pipelines.live.localizer_node import LocalizerNode, LocalizerStart

    return LocalizerNode(node, Config(), LocalizerStart(**start), view)


def mapper(
    node: "BusNode", out: Path, view: Any = None, announce: Callable[[str], None] = lambda sentence: None
) -> Any:
    """The same, which goes on with a drive that was broken off."""
    from racecar.pipelines.live.mapper_node import MapperNode
    from racecar.pipelines.live.saving.drive_log import DriveLog
    from racecar.pipelines.live.saving.live_drive import LiveDrive
    from racecar.pipelines.live.saving.map_saving import MapOutput

    log = DriveLog(out)
    log.go_on(announce)
    return MapperNode(node, LiveDrive(MapOutput(out, Config(), {"live": True}), log), view)


def map_message(grid: OccupancyGrid) -> Any:
    """As a map server publishes it."""
    from racecar.pipelines.live.ros.messages import grid_message, time_message

    return grid_message(time_message(0), "map", grid)


def initial_pose(pose: Pose) -> Any:
    """As RViz's tool publishes it."""
    from racecar.pipelines.live.ros.messages import pose_message, time_message

    return pose_message(time_message(time.time_ns()), "map", pose, np.diag([0.04, 0.04, 0.01]))
