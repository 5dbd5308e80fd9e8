"""Receives what a node publishes, in another process."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry as OdometryMessage
from sensor_msgs.msg import LaserScan

from racecar.maps.geometry.se2 import Pose
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.converters.odometry import planar_pose
from racecar.pipelines.bags.messages import nanoseconds
from racecar.pipelines.live.ros.qos import sensor_qos
from racecar.pipelines.live.ros.run import ros_node, served


class NodeListener:
    """Collects the scans that a node receives too, and the poses that it publishes."""

    def __init__(self, node: Any) -> None:
        self._node = node
        self._poses: dict[int, Pose] = {}
        self._scans_at: dict[int, float] = {}
        self._poses_at: dict[int, float] = {}
        self.pose_messages = 0
        node.create_subscription(LaserScan, "/scan", self._on_scan, sensor_qos(1000))
        node.create_subscription(PoseWithCovarianceStamped, "/amcl_pose", self._on_pose, 1000)
        node.create_subscription(OdometryMessage, "/pf/pose/odom", self._on_odometry, 1000)

    def is_node_there(self) -> bool:
        """Whether another node has subscribed to scans."""
        return int(self._node.count_subscribers("/scan")) > 1

    def latency_ms(self) -> dict[str, float]:
        """Median and 99th percentile of the time from a scan's arrival here to its pose's."""
        both = [
            (self._scans_at[stamp], at) for stamp, at in self._poses_at.items() if stamp in self._scans_at
        ]
        if not both:
            return {}
        median, high = np.quantile([1e3 * (pose - scan) for scan, pose in both], [0.5, 0.99])
        return {"median": float(median), "percentile_99": float(high)}

    def trajectory(self) -> Trajectory:
        """The poses by the stamps of their scans."""
        stamps = sorted(self._poses)
        return Trajectory(
            np.array(stamps, dtype=np.int64), np.array([self._poses[s] for s in stamps]).reshape(-1, 3)
        )

    def _on_scan(self, message: Any) -> None:
        self._scans_at[nanoseconds(message.header.stamp)] = time.monotonic()

    def _on_pose(self, message: Any) -> None:
        self._poses_at[nanoseconds(message.header.stamp)] = time.monotonic()
        pose = planar_pose(message)
        if pose is not None:
            self._poses[nanoseconds(message.header.stamp)] = pose

    def _on_odometry(self, message: Any) -> None:
        self.pose_messages += 1


@contextmanager
def listening() -> Iterator[NodeListener]:
    """Listen during the block."""
    with ros_node("racecar_benchmark", []) as node:
        heard = NodeListener(node)
        with served(node):
            yield heard
