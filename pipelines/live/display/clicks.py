"""Goals and places that are clicked on the page, as messages such as RViz sends."""

import math
from typing import Any

import numpy as np
from geometry_msgs.msg import Point, PointStamped, PoseStamped, PoseWithCovarianceStamped

from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.live.display.clicked_topic import ClickedTopic
from racecar.pipelines.live.ros.messages import fill_pose, header, pose_message
from racecar.pipelines.studio.pointed import Pointed

_REMEDY = "the localizer is starting, so try again"


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
