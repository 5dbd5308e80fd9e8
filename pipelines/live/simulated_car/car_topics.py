"""Publish a simulated car's sensors, frames, true pose, and the time."""

from array import array
from dataclasses import dataclass
from typing import Any

import numpy as np
from nav_msgs.msg import Odometry as OdometryMessage
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan

from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.live.ros.message_types import transform_message_type
from racecar.pipelines.live.ros.messages import header, odometry_message, time_message, transform_bytes
from racecar.pipelines.live.ros.qos import LATCHED
from racecar.pipelines.simulation.laser_models import BASE_FROM_LASER, LaserModel
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

_DEPTH = 100
"""Queue size, the same as in players of bags."""
_EXACT = np.zeros((3, 3))


@dataclass(frozen=True)
class FrameNames:
    """Frames, all but the map's with the car's namespace, so that several cars can be shown in one tree."""

    map: str
    odom: str
    base: str
    laser: str

    @classmethod
    def in_namespace(cls, namespace: str) -> "FrameNames":
        """The frames for a node's namespace such as ``/`` or ``/car1``."""
        prefix = f"{namespace}/".lstrip("/")
        return cls("map", f"{prefix}odom", f"{prefix}base_link", f"{prefix}laser")


class CarTopics:
    """Publishers in the node's namespace; frames go to the shared tree."""

    def __init__(self, node: Any, frames: FrameNames, laser: LaserModel) -> None:
        self._frames, self._laser = frames, laser
        self._scans = node.create_publisher(LaserScan, "scan", _DEPTH)
        self._odometry = node.create_publisher(OdometryMessage, "odom", _DEPTH)
        self._truth = node.create_publisher(OdometryMessage, "ground_truth", _DEPTH)
        self._clock = node.create_publisher(Clock, "clock", _DEPTH)
        self._transforms = node.create_publisher(transform_message_type(), "/tf", _DEPTH)
        self._places = node.create_publisher(transform_message_type(), "/tf_static", LATCHED)
        self._places.publish(transform_bytes(0, frames.base, frames.laser, BASE_FROM_LASER))

    def publish_odometry(self, sample: Odometry) -> None:
        """Publish the time, then odometry as message and as transform."""
        frames, stamp = self._frames, time_message(sample.stamp)
        self._clock.publish(Clock(clock=stamp))
        self._odometry.publish(
            odometry_message(stamp, frames.odom, frames.base, sample.odom_from_base, _EXACT, sample.twist)
        )
        self._transforms.publish(
            transform_bytes(sample.stamp, frames.odom, frames.base, sample.odom_from_base)
        )

    def publish_truth(self, stamp: int, map_from_base: Pose, twist: Pose) -> None:
        """Publish the car's true pose (3,) and twist (3,)."""
        frames = self._frames
        self._truth.publish(
            odometry_message(time_message(stamp), frames.map, frames.base, map_from_base, _EXACT, twist)
        )

    def publish_scan(self, scan: Scan) -> None:
        """Publish a scan, stamped at its first beam."""
        laser = self._laser
        self._scans.publish(
            LaserScan(
                header=header(time_message(scan.stamp), self._frames.laser),
                angle_min=laser.angle_min,
                angle_max=-laser.angle_min,
                angle_increment=laser.angle_increment,
                time_increment=laser.time_increment,
                scan_time=laser.scan_time,
                range_min=laser.range_min,
                range_max=laser.range_max,
                ranges=array("f", scan.ranges.astype(np.float32).tobytes()),
            )
        )
