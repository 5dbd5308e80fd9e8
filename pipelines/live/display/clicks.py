"""Publish goals and places clicked on the page as the messages that RViz sends."""

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
"""Name that ROS gives to nodes of which only the topic has been discovered."""


class Clicks:
    """Publishes clicks until it is closed; thread-safe."""

    def __init__(self, node: Any, map_frame: str, *, tells_places: bool) -> None:
        """``tells_places``: whether clicks may set the car's place, besides goals."""
        self._node, self._map_frame, self._lock, self._is_open = node, map_frame, Lock(), True
        self._goals = node.create_publisher(PoseStamped, "goal_pose", 10)
        if tells_places:
            self._poses = node.create_publisher(PoseWithCovarianceStamped, "initialpose", 10)
            self._points = node.create_publisher(PointStamped, "clicked_point", 10)

    def send_goal(self, map_from_goal: Pose) -> str:
        """Publish a goal (3,) like RViz's 2D Goal Pose; returns a sentence that names the receivers. Raises
        UserError if there is no subscriber."""
        goal = PoseStamped(header=self._header())
        fill_pose(goal.pose, map_from_goal)
        listeners = self._publish(self._goals, goal, "start a navigation or `racecar live simulate`")
        x, y, yaw = map_from_goal
        return f"The goal x {x:.2f} m, y {y:.2f} m, heading {math.degrees(yaw):.0f}° went to {listeners}."

    def send_place(self, shown: Pointed) -> str:
        """Set the car's place like RViz's 2D Pose Estimate, or its Publish Point if there is no heading;
        returns a sentence that names the receivers. Raises UserError if there is no subscriber."""
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
        """Stop publishing."""
        with self._lock:
            self._is_open = False

    def _header(self) -> Any:
        return header(self._node.get_clock().now().to_msg(), self._map_frame)

    def _publish(self, publisher: Any, message: Any, remedy: str) -> str:
        """Publish and return the names of the subscribers."""
        name = publisher.topic_name  # with namespace and remapping
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
