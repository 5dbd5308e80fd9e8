"""A simulated car that drives now: it publishes over real DDS, and whoever tests can spoil what it says."""

import time
from array import array
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from threading import Event, Lock, Thread
from typing import Any

import numpy as np

from racecar.maps.geometry.se2 import Pose, between
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.bags.converters.odometry import planar_pose
from racecar.pipelines.bags.messages import TRANSFORMS, nanoseconds, ros2_types
from racecar.pipelines.simulation.floor_canvas import draw_ring
from racecar.pipelines.simulation.laser_models import BASE_FROM_LASER, UST_10LX
from racecar.pipelines.simulation.simulator import LaserSweep, Simulation
from racecar.pipelines.simulation.simulator_config import SimulationConfig
from racecar.sensors.odometry import Odometry

SECONDS = 110.0


@cache
def ring() -> OccupancyGrid:
    return draw_ring()


@cache
def simulation() -> Simulation:
    return Simulation(ring(), SimulationConfig(noise="slight", seed=0, duration=SECONDS))


@cache
def recorded() -> list[tuple[int, LaserSweep | tuple[Odometry, Odometry], Pose]]:
    """What the car says, when, and where it truly is then."""
    drive = simulation()
    truth = dict(zip(drive.ground_truth.stamps.tolist(), drive.ground_truth.map_from_base, strict=True))
    # A sweep is sent when its last beam is in.
    last_beam = round(UST_10LX.time_offsets[-1] * 1e9)
    sweeps = [(sweep.stamp + last_beam, sweep, truth[sweep.stamp]) for sweep in drive.sweeps()]
    samples = [
        (measured.stamp, (measured, true), true.odom_from_base)
        for measured, true in zip(drive.odometry(), drive.true_odometry(), strict=True)
    ]
    return sorted([*sweeps, *samples], key=lambda each: each[0])


class LiveCar:
    """Publishes /scan, /odom and /tf_static at real speed, from the place in the drive where it was left."""

    def __init__(self, node: Any) -> None:
        from nav_msgs.msg import Odometry as OdometryMessage
        from rclpy.qos import qos_profile_sensor_data
        from sensor_msgs.msg import LaserScan

        from racecar.pipelines.live.ros.message_types import transform_message_type
        from racecar.pipelines.live.ros.qos import LATCHED

        self.scans_on = self.odometry_on = True
        self.shift = 0
        """Nanoseconds by which the clock of the car is off."""
        self.restamp: dict[str, Callable[[int], int]] = {"scan": _as_it_is, "odometry": _as_it_is}
        """What the clock of each sensor makes of a time, in nanoseconds."""
        self.frames = ["laser"]
        """Of the scans, which take turns."""
        self.odometry_links: tuple[str, str] | None = None
        """Parent and child, where the odometry is published on /tf and nowhere else."""
        self.repeated_links: list[tuple[str, str, Pose]] = []
        """Parents, children and poses that are published with it again and again."""
        self.has_imu = False
        """Whether there is a gyroscope, which is off by 0.02 rad/s, mounted upside down."""
        self.spoil_odometry: Callable[[Odometry], Odometry] = lambda sample: sample
        """What is done to every sample before it goes out."""
        self.spoil: Callable[[Any], None] = lambda message: None
        """What is done to every LaserScan before it goes out."""
        self.scans_per_sweep = 1
        self.truth: dict[int, Pose] = {}
        """``map_from_base`` by the stamp of a message's header."""
        self.undisturbed: dict[int, Pose] = {}
        """The same by the stamps as they were if nobody had set the clock."""
        self.by_time: dict[int, Pose] = {}
        """The same by the computer's time, whatever the stamps say."""
        self.place: Pose = recorded()[0][2]
        """``map_from_base`` now."""
        self.scans_sent = 0
        self.odometry_sent = 0
        self._node = node
        self._transform_topics: dict[str, Any] = {}
        self._imu_topic: Any = None
        self._scan_lock = Lock()
        self._scan_topic: Any = None
        self.say_scans_as(LaserScan, lambda message: message)
        self._odometry_topic = node.create_publisher(OdometryMessage, "/odom", qos_profile_sensor_data)
        self._place_topic = node.create_publisher(transform_message_type(), "/tf_static", LATCHED)
        self._place_topic.publish(_place())
        self._next = 0

    def say_scans_as(self, kind: Any, form: Callable[[Any], Any]) -> None:
        """Publish scans as another type, as ``form`` makes it of a LaserScan."""
        from rclpy.impl.implementation_singleton import rclpy_implementation
        from rclpy.qos import qos_profile_sensor_data

        with self._scan_lock:
            before, self._scan_topic, self._form = self._scan_topic, None, form
        if before is not None:
            self._node.destroy_publisher(before)
        until = time.monotonic() + 5.0
        while self._scan_topic is None:  # the process has the topic with the other type for a moment
            try:
                self._scan_topic = self._node.create_publisher(kind, "/scan", qos_profile_sensor_data)
            except rclpy_implementation.RCLError:
                assert time.monotonic() < until
                time.sleep(0.05)

    def link(
        self,
        topic: str,
        parent: str,
        child: str,
        pose: Pose,
        *,
        is_upside_down: bool = False,
        stamp: int = 0,
    ) -> None:
        """Publish where a frame is in another: ``parent_from_child`` (3,)."""
        if topic not in self._transform_topics:
            from racecar.pipelines.live.ros.message_types import transform_message_type
            from racecar.pipelines.live.ros.qos import LATCHED

            publisher = self._node.create_publisher(transform_message_type(), topic, LATCHED)
            self._transform_topics[topic] = publisher
        message = transform_in_space(parent, child, pose, is_upside_down, stamp)
        self._transform_topics[topic].publish(message)

    def hush_odometry(self) -> None:
        """Nobody publishes /odom."""
        self._node.destroy_publisher(self._odometry_topic)

    def hush_place(self) -> None:
        """Nodes that come later are not told where the laser sits."""
        self._node.destroy_publisher(self._place_topic)

    @contextmanager
    def driving(self) -> Iterator[None]:
        """Drive while the block lasts."""
        stop = Event()
        thread = Thread(target=self._drive, args=(stop,), daemon=True)
        thread.start()
        try:
            yield
        finally:
            stop.set()
            thread.join()

    def _drive(self, stop: Event) -> None:
        log = recorded()
        started, first, wall = time.monotonic(), log[self._next][0], time.time_ns()
        while self._next < len(log) and not stop.is_set():
            due, said, truth = log[self._next]
            time.sleep(max(0.0, started + (due - first) * 1e-9 - time.monotonic()))
            of_wall = wall - first + self.shift
            measured = said.stamp if isinstance(said, LaserSweep) else said[0].stamp
            self.place = self.by_time[measured + wall - first] = truth
            if isinstance(said, LaserSweep):
                self._send_scan(said, self.restamp["scan"](said.stamp + of_wall), truth)
            else:
                stamp = said[0].stamp + of_wall
                self._send_imu(-0.02 - said[1].twist[2], stamp)
                self._send_odometry(said[0], self.restamp["odometry"](stamp), truth)
            self._next += 1

    def _send_scan(self, sweep: LaserSweep, stamp: int, truth: Pose) -> None:
        from sensor_msgs.msg import LaserScan

        from racecar.pipelines.live.ros.messages import header, time_message

        if not self.scans_on:
            return
        message = LaserScan(
            header=header(time_message(stamp), self.frames[self.scans_sent % len(self.frames)]),
            angle_min=UST_10LX.angle_min,
            angle_max=-UST_10LX.angle_min,
            angle_increment=UST_10LX.angle_increment,
            time_increment=UST_10LX.time_increment,
            scan_time=UST_10LX.scan_time,
            range_min=UST_10LX.range_min,
            range_max=UST_10LX.range_max,
            ranges=array("f", sweep.ranges.tobytes()),
        )
        self.spoil(message)
        self.truth[stamp] = self.undisturbed[stamp - self.shift] = truth
        with self._scan_lock:
            if self._scan_topic is None:
                return
            formed = self._form(message)
            for _ in range(self.scans_per_sweep):
                self._scan_topic.publish(formed)
        self.scans_sent += 1

    def _send_imu(self, rate: float, stamp: int) -> None:
        from racecar.pipelines.live.ros.messages import header, time_message

        if self.has_imu:
            from sensor_msgs.msg import Imu

            if self._imu_topic is None:
                self._imu_topic = self._node.create_publisher(Imu, "/imu", 100)
            message = Imu(header=header(time_message(stamp), "imu"))
            message.angular_velocity.z = float(rate)
            self._imu_topic.publish(message)

    def _send_odometry(self, sample: Odometry, stamp: int, truth: Pose) -> None:
        from racecar.pipelines.live.ros.messages import odometry_message, time_message

        if not self.odometry_on:
            return
        self.truth[stamp] = truth
        self.odometry_sent += 1
        sample = self.spoil_odometry(sample)
        if self.odometry_links is not None:
            self.link("/tf", *self.odometry_links, sample.odom_from_base, stamp=stamp)
            for parent, child, pose in self.repeated_links:
                self.link("/tf", parent, child, pose, stamp=stamp)
            return
        self._odometry_topic.publish(
            odometry_message(
                time_message(stamp),
                "odom",
                "base_link",
                sample.odom_from_base,
                np.zeros((3, 3)),
                sample.twist,
            )
        )


def _as_it_is(stamp: int) -> int:
    return stamp


def transform_in_space(parent: str, child: str, pose: Pose, is_upside_down: bool, stamp: int) -> bytes:
    """A serialized TFMessage; upside down is turned about the x axis of the child."""
    types = ros2_types().types
    half = float(pose[2]) / 2
    cos, sin = float(np.cos(half)), float(np.sin(half))
    x, y, z, w = (cos, sin, 0.0, 0.0) if is_upside_down else (0.0, 0.0, sin, cos)
    transform = types["geometry_msgs/msg/TransformStamped"](
        header=types["std_msgs/msg/Header"](
            stamp=types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9),
            frame_id=parent,
        ),
        child_frame_id=child,
        transform=types["geometry_msgs/msg/Transform"](
            translation=types["geometry_msgs/msg/Vector3"](x=float(pose[0]), y=float(pose[1]), z=0.2),
            rotation=types["geometry_msgs/msg/Quaternion"](x=x, y=y, z=z, w=w),
        ),
    )
    return bytes(ros2_types().serialize_cdr(types[TRANSFORMS](transforms=[transform]), TRANSFORMS))


def _place() -> bytes:
    from racecar.pipelines.live.ros.messages import transform_bytes

    return transform_bytes(0, "base_link", "laser", BASE_FROM_LASER)


BUSY = 5.0
"""Times as long as on a quiet machine a node may take where others use the processors, too."""


@dataclass
class Heard:
    """A pose that a node published."""

    at: float
    stamp: int
    pose: Pose


@dataclass
class Witness:
    """Hears what the nodes say."""

    car: LiveCar
    log: Path
    odometry: list[Heard] = field(default_factory=list)
    poses: list[Heard] = field(default_factory=list)
    transforms: list[tuple[str, str, Heard]] = field(default_factory=list)
    statuses: list[Any] = field(default_factory=list)

    def listen(self, node: Any) -> None:
        from diagnostic_msgs.msg import DiagnosticArray
        from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
        from nav_msgs.msg import Odometry as OdometryMessage

        from racecar.pipelines.live.ros.message_types import transform_message_type

        node.create_subscription(OdometryMessage, "/pf/pose/odom", self._hear(self.odometry), 100)
        node.create_subscription(PoseWithCovarianceStamped, "/amcl_pose", self._hear(self.poses), 100)
        node.create_subscription(PoseStamped, "/tracked_pose", self._hear_stamped, 100)
        node.create_subscription(
            DiagnosticArray, "/diagnostics", lambda message: self.statuses.extend(message.status), 10
        )
        node.create_subscription(transform_message_type(), "/tf", self._hear_transform, 100, raw=True)

    def is_right(self, since: float, count: int = 10) -> bool:
        """Whether so many poses that came lately are where the car truly is."""
        latest = [heard for heard in self.odometry[-count:] if heard.at > since]
        return len(latest) == count and all(self.error(heard) < 0.15 for heard in latest)

    def error(self, heard: Heard) -> float:
        """Metres plus radians from the truth."""
        missed = between(self.truth_at(heard.stamp), heard.pose)
        return float(np.hypot(missed[0], missed[1]) + abs(missed[2]))

    def truth_at(self, stamp: int) -> Pose:
        """Where the car truly was; a stamp that the node made or mended is some milliseconds off."""
        truth, by_time = self.car.truth.get(stamp), self.car.by_time
        return by_time[min(list(by_time), key=lambda each: abs(each - stamp))] if truth is None else truth

    def seconds_until_right(self, within: float) -> float:
        """From now; fails when it takes longer than ``within``."""
        since = time.monotonic()
        wait_for(
            lambda: self.is_right(since), within, lambda: f"errors {self.latest_errors()}; {self.said()}"
        )
        return time.monotonic() - since

    def latest_errors(self) -> list[float]:
        return [round(self.error(heard), 2) for heard in self.odometry[-10:]]

    def warnings(self, words: str) -> list[str]:
        """Lines of the nodes' log that warn of something."""
        return [line for line in self.log.read_text().splitlines() if "[WARN]" in line and words in line]

    def said(self) -> str:
        return self.log.read_text()[-2000:]

    def await_diagnosis(self, words: str, within: float = 6.0) -> None:
        """Until ``/diagnostics`` says something from now on."""
        self.statuses.clear()
        wait_for(
            lambda: any(words in status.message for status in self.statuses),
            within,
            lambda: f"{words!r} not among {[status.message for status in self.statuses]}; {self.said()}",
        )

    def figure(self, key: str) -> str | None:
        """The latest figure in ``/diagnostics``."""
        values = [value for status in self.statuses for value in status.values if value.key == key]
        return values[-1].value if values else None

    def _hear(self, heard: list[Heard]) -> Callable[[Any], None]:
        def hear(message: Any) -> None:
            pose = planar_pose(message)
            assert pose is not None
            heard.append(Heard(time.monotonic(), nanoseconds(message.header.stamp), pose))

        return hear

    def _hear_stamped(self, message: Any) -> None:
        q = message.pose.orientation
        pose = np.array([message.pose.position.x, message.pose.position.y, 2 * np.arctan2(q.z, q.w)])
        self.poses.append(Heard(time.monotonic(), nanoseconds(message.header.stamp), pose))

    def _hear_transform(self, data: bytes) -> None:
        for each in ros2_types().deserialize_cdr(data, TRANSFORMS).transforms:
            place, turn = each.transform.translation, each.transform.rotation
            pose = np.array([place.x, place.y, 2 * np.arctan2(turn.z, turn.w)])
            heard = Heard(time.monotonic(), nanoseconds(each.header.stamp), pose)
            self.transforms.append((each.header.frame_id, each.child_frame_id, heard))


def wait_for(condition: Callable[[], bool], within: float, explain: Callable[[], str]) -> None:
    """Ask again and again; fails the test after many times ``within``, seconds on a quiet machine."""
    until = time.monotonic() + BUSY * within
    while not condition():
        assert time.monotonic() < until, explain()
        time.sleep(0.02)
