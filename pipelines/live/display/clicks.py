"""Goals and places that are clicked on the page, as messages such as RViz sends."""

import math
from collections.abc import Callable
from threading import Lock
from typing import Any

import numpy as np
from geometry_msgs.msg import Point, PointStamped, PoseStamped, PoseWithCovarianceStamped

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.live.ros.messages import fill_pose, header, pose_message
from racecar.pipelines.live.ros.qos import is_heard
from racecar.pipelines.studio.pointed import Pointed

_REMEDY = "the localizer is starting, so try again"
_UNKNOWN = "_NODE_NAME_UNKNOWN_"
"""As ROS calls nodes of whom nothing but their topic has become known yet."""


class ClickedGoals:
    """Published on ``goal_pose``, as by RViz's 2D Goal Pose."""

    def __init__(self, node: Any, map_frame: str) -> None:
        self._map_frame = map_frame
        self._topic = ClickedTopic(node, PoseStamped, "goal_pose")

    def send(self, map_from_goal: Pose) -> str:
        """Send a goal (3,); the sentence that says to whom. Raises UserError where nobody listens."""

        def message(stamp: Any) -> Any:
            goal = PoseStamped(header=header(stamp, self._map_frame))
            fill_pose(goal.pose, map_from_goal)
            return goal

        listeners = self._topic.publish(message, "start a navigation or `racecar live simulate`")
        x, y, yaw = map_from_goal
        return f"The goal x {x:.2f} m, y {y:.2f} m, heading {math.degrees(yaw):.0f}° went to {listeners}."

    def close(self) -> None:
        """Send nothing any more."""
        self._topic.close()


class ClickedPlaces:
    """Poses are published on ``initialpose``, as by RViz's 2D Pose Estimate, and places without a heading on
    ``clicked_point``, as by its Publish Point."""

    def __init__(self, node: Any, map_frame: str) -> None:
        self._map_frame = map_frame
        self._poses = ClickedTopic(node, PoseWithCovarianceStamped, "initialpose")
        self._points = ClickedTopic(node, PointStamped, "clicked_point")

    def send(self, shown: Pointed) -> str:
        """Say that the car is there; the sentence that says to whom. Raises UserError where nobody
        listens."""
        x, y = shown.place.tolist()
        if shown.heading is None:
            return self._send_point(x, y)
        variances = np.array([shown.spread, shown.spread, shown.heading_spread]) ** 2
        pose, covariance = np.array([x, y, shown.heading]), np.diag(variances)
        listeners = self._poses.publish(
            lambda stamp: pose_message(stamp, self._map_frame, pose, covariance), _REMEDY
        )
        degrees, spread = math.degrees(shown.heading), math.degrees(shown.heading_spread)
        return (
            f"The pose x {x:.2f} m, y {y:.2f} m (± {shown.spread:.1f} m), heading {degrees:.0f}° "
            f"(± {spread:.0f}°) went to {listeners}."
        )

    def close(self) -> None:
        """Send nothing any more."""
        self._poses.close()
        self._points.close()

    def _send_point(self, x: float, y: float) -> str:
        listeners = self._points.publish(
            lambda stamp: PointStamped(header=header(stamp, self._map_frame), point=Point(x=x, y=y)), _REMEDY
        )
        return f"The place x {x:.2f} m, y {y:.2f} m, heading unknown, went to {listeners}."


class ClickedTopic:
    """Publishes until it is closed, and tells who listens; may be called by any thread."""

    def __init__(self, node: Any, kind: Any, name: str) -> None:
        self._node, self._lock = node, Lock()
        self._publisher = node.create_publisher(kind, name, 10)
        self._is_open = True
        self.name: str = self._publisher.topic_name
        """As it is called in the node's namespace, and by its remapping."""

    def publish(self, message: Callable[[Any], Any], remedy: str) -> str:
        """Publish a message made with the stamp of now; who listens, for people to read. Raises UserError
        when nobody does, with the remedy, or the node is ending."""
        with self._lock:
            if not self._is_open:
                raise UserError("Nothing is sent any more, as the node is ending.")
            if not is_heard(self._publisher):
                raise UserError(f"Nobody listens on {self.name}; {remedy}.")
            self._publisher.publish(message(self._node.get_clock().now().to_msg()))
            return self._listeners()

    def close(self) -> None:
        """Publish nothing any more."""
        with self._lock:
            self._is_open = False

    def _listeners(self) -> str:
        endpoints = self._node.get_subscriptions_info_by_topic(self.name)
        names = {f"{each.node_namespace}/{each.node_name}".lstrip("/") for each in endpoints}
        known = sorted(name for name in names if _UNKNOWN not in name)
        return f"{', '.join(known) or 'a node'} (on {self.name})"
