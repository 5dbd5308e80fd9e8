"""A simulated car that drives on a bus, and whoever tests can spoil what it says."""

import time
from array import array
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, partial
from threading import Event, Thread
from typing import TYPE_CHECKING, Any

import numpy as np

from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.pipelines.bags.messages import TRANSFORMS, ros2_types
from racecar.pipelines.simulation.laser_models import BASE_FROM_LASER, UST_10LX
from racecar.pipelines.simulation.simulator import Simulation
from racecar.pipelines.simulation.simulator_config import SimulationConfig
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.pipelines.message_samples import link

if TYPE_CHECKING:
    from tests.pipelines.live.bus import BusNode

SECONDS = 110.0
USUAL_SPEED = 2.0
"""m/s at most."""


@cache
def ring() -> OccupancyGrid:
    return load_map("ring")


@cache
def simulation(seconds: float = SECONDS, max_speed: float = USUAL_SPEED) -> Simulation:
    return Simulation(ring(), SimulationConfig(noise="slight", seed=0, duration=seconds, max_speed=max_speed))


@cache
def recorded(
    seconds: float = SECONDS, max_speed: float = USUAL_SPEED
) -> list[tuple[int, Scan | tuple[Odometry, Odometry], Pose]]:
    """What the car says, when, and where it truly is then."""
    drive = simulation(seconds, max_speed)
    truth = dict(zip(drive.ground_truth.stamps.tolist(), drive.ground_truth.map_from_base, strict=True))
    # A sweep is sent when its last beam is in.
    last_beam = round(UST_10LX.time_offsets[-1] * 1e9)
    scans = [(scan.stamp + last_beam, scan, truth[scan.stamp]) for scan in drive.scans()]
    samples = [
        (measured.stamp, (measured, true), true.odom_from_base)
        for measured, true in zip(drive.odometry(), drive.true_odometry(), strict=True)
    ]
    return sorted([*scans, *samples], key=lambda each: each[0])


class LiveCar:
    """Publishes /scan, /odom and /tf_static."""

    def __init__(self, node: "BusNode") -> None:
        from nav_msgs.msg import Odometry as OdometryMessage
        from rclpy.qos import qos_profile_sensor_data
        from sensor_msgs.msg import LaserScan

        from racecar.pipelines.live.ros.message_types import transform_message_type
        from racecar.pipelines.live.ros.qos import LATCHED

        self.scans_on = self.odometry_on = True
        self.shift = 0
        """Nanoseconds by which the clock of the car is off."""
        self.restamp_scan: Callable[[int], int] = lambda stamp: stamp
        self.restamp_odometry: Callable[[int], int] = lambda stamp: stamp
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
        self.node = node
        self._transform_topics: dict[str, Any] = {}
        self._imu_topic: Any = None
        self._scan_topic: Any = None
        self.say_scans_as(LaserScan, lambda message: message)
        self._odometry_topic = node.create_publisher(OdometryMessage, "/odom", qos_profile_sensor_data)
        self._place_topic = node.create_publisher(transform_message_type(), "/tf_static", LATCHED)
        self._place_topic.publish(_place())

    def say_scans_as(self, kind: Any, form: Callable[[Any], Any]) -> None:
        """Publish scans as another type, as ``form`` makes it of a LaserScan."""
        from rclpy.qos import qos_profile_sensor_data

        if self._scan_topic is not None:
            self.node.destroy_publisher(self._scan_topic)
        self._scan_topic, self._form = (
            self.node.create_publisher(kind, "/scan", qos_profile_sensor_data),
            form,
        )

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
        """Publish where a frame is in another: ``parent_from_child`` (3,); upside down is turned about the x
        axis of the child."""
        if topic not in self._transform_topics:
            from racecar.pipelines.live.ros.message_types import transform_message_type
            from racecar.pipelines.live.ros.qos import LATCHED

            publisher = self.node.create_publisher(transform_message_type(), topic, LATCHED)
            self._transform_topics[topic] = publisher
        x, y, yaw = pose
        cos, sin = np.cos(yaw / 2.0), np.sin(yaw / 2.0)
        rotation = (cos, sin, 0.0, 0.0) if is_upside_down else (0.0, 0.0, sin, cos)
        message = link(parent, child, (x, y, 0.2), rotation, stamp)
        self._transform_topics[topic].publish(bytes(ros2_types().serialize_cdr(message, TRANSFORMS)))

    def hush_odometry(self) -> None:
        """Nobody publishes /odom."""
        self.node.destroy_publisher(self._odometry_topic)

    def hush_place(self) -> None:
        """Nodes that come later are not told where the laser sits."""
        self.node.destroy_publisher(self._place_topic)

    def drive(self, *seconds_and_speed: float) -> None:
        """From now on, to the end of what is `recorded` so."""
        bus, all_said = self.node.bus, recorded(*seconds_and_speed)
        first = all_said[0][0]
        for due, said, truth in all_said:
            bus.at(bus.monotonic + due - first, partial(self.say, said, truth, bus.wall - first))

    @contextmanager
    def driving(self, seconds: float) -> Iterator[None]:
        """During the block, by the computer's clock; after the ``seconds`` nothing more is said."""
        is_over, all_said = Event(), recorded(seconds)

        def drive() -> None:
            first, began, wall = all_said[0][0], time.monotonic_ns(), time.time_ns()
            for due, said, truth in all_said:
                if is_over.wait(max(0.0, (began + due - first - time.monotonic_ns()) * 1e-9)):
                    return
                self.say(said, truth, wall - first)

        thread = Thread(target=drive, name="car")
        thread.start()
        try:
            yield
        finally:
            is_over.set()
            thread.join()

    def say(self, said: Scan | tuple[Odometry, Odometry], truth: Pose, wall_from_recorded: int) -> None:
        """Publish something of what is recorded, stamped later by so many nanoseconds."""
        measured = said.stamp if isinstance(said, Scan) else said[0].stamp
        self.place = self.by_time[measured + wall_from_recorded] = truth
        stamp = measured + wall_from_recorded + self.shift
        if isinstance(said, Scan):
            self._send_scan(said, self.restamp_scan(stamp), truth)
        else:
            self._send_imu(-0.02 - said[1].twist[2], stamp)
            self._send_odometry(said[0], self.restamp_odometry(stamp), truth)

    def _send_scan(self, scan: Scan, stamp: int, truth: Pose) -> None:
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
            ranges=array("f", scan.ranges),
        )
        self.spoil(message)
        self.truth[stamp] = self.undisturbed[stamp - self.shift] = truth
        formed = self._form(message)
        for _ in range(self.scans_per_sweep):
            self._scan_topic.publish(formed)
        self.scans_sent += 1

    def _send_imu(self, rate: float, stamp: int) -> None:
        from racecar.pipelines.live.ros.messages import header, time_message

        if self.has_imu:
            from sensor_msgs.msg import Imu

            if self._imu_topic is None:
                self._imu_topic = self.node.create_publisher(Imu, "/imu", 100)
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


def _place() -> bytes:
    from racecar.pipelines.live.ros.messages import transform_bytes

    return transform_bytes(0, "base_link", "laser", BASE_FROM_LASER)
