"""Goals and places that are clicked on the page, as messages such as RViz sends."""

import math
from threading import Lock
from typing import Any

import numpy as np
from geometry_msgs.msg import Point, PointStamped, PoseStamped, PoseWithCovarianceStamped

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.live.ros.messages import fill_pose, header, pose_message
from racecar.pipelines.live.ros.qos import is_heard
from racecar.pipelines.studio.pointed import Pointed

_UNKNOWN = "_NODE_NAME_UNKNOWN_"
"""As ROS calls nodes of whom nothing but their topic has become known yet."""


class Clicks:
    """Published until it is closed; may be called by any thread."""

    def __init__(self, node: Any, map_frame: str, *, tells_places: bool) -> None:
        """``tells_places``: whether clicks may say where the car is, besides goals."""
        self._node, self._map_frame, self._lock, self._is_open = node, map_frame, Lock(), True
        self._goals = node.create_publisher(PoseStamped, "goal_pose", 10)
        if tells_places:
            self._poses = node.create_publisher(PoseWithCovarianceStamped, "initialpose", 10)
            self._points = node.create_publisher(PointStamped, "clicked_point", 10)

    def send_goal(self, map_from_goal: Pose) -> str:
        """Publish a goal (3,), as RViz's 2D Goal Pose does; the sentence that says to whom. Raises UserError
        where nobody listens."""
        goal = PoseStamped(header=self._header())
        fill_pose(goal.pose, map_from_goal)
        listeners = self._publish(self._goals, goal, "start a navigation or `racecar live simulate`")
        x, y, yaw = map_from_goal
        return f"The goal x {x:.2f} m, y {y:.2f} m, heading {math.degrees(yaw):.0f}° went to {listeners}."

    def send_place(self, shown: Pointed) -> str:
        """Say that the car is there, as RViz's 2D Pose Estimate does, or without a heading as its Publish
        Point; the sentence that says to whom. Raises UserError where nobody listens."""
        x, y = shown.place.tolist()
        if shown.heading is None:
            topic, message = self._points, PointStamped(header=self._header(), point=Point(x=x, y=y))
            what = f"The place x {x:.2f} m, y {y:.2f} m, heading unknown,"
        else:
            variances = np.array([shown.spread, shown.spread, shown.heading_spread]) ** 2
            topic, head = self._poses, self._header()
            pose = np.array([x, y, shown.heading])
            message = pose_message(head.stamp, head.frame_id, pose, np.diag(variances))
            degrees, spread = math.degrees(shown.heading), math.degrees(shown.heading_spread)
            what = f"The pose x {x:.2f} m, y {y:.2f} m (± {shown.spread:.1f} m), heading {degrees:.0f}° "
            what += f"(± {spread:.0f}°)"
        return f"{what} went to {self._publish(topic, message, 'the localizer is starting, so try again')}."

    def close(self) -> None:
        """Publish nothing any more."""
        with self._lock:
            self._is_open = False

    def _header(self) -> Any:
        return header(self._node.get_clock().now().to_msg(), self._map_frame)

    def _publish(self, publisher: Any, message: Any, remedy: str) -> str:
        """Who listens, for people to read."""
        name = publisher.topic_name  # in the node's namespace, and as it was remapped
        with self._lock:
            if not self._is_open:
                raise UserError("Nothing is sent any more, as the node is ending.")
            if not is_heard(publisher):
                raise UserError(f"Nobody listens on {name}; {remedy}.")
            publisher.publish(message)
            endpoints = self._node.get_subscriptions_info_by_topic(name)
        names = {f"{each.node_namespace}/{each.node_name}".lstrip("/") for each in endpoints}
        known = sorted(each for each in names if _UNKNOWN not in each)
        return f"{', '.join(known) or 'a node'} (on {name})"
