"""The last goal sent, and the car's distance from it."""

import math
import time

import numpy as np
from numpy.typing import NDArray

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.studio.outlines import arrow, cross
from racecar.pipelines.studio.pointed import Pointed

_THERE = 0.3
"""Metres from the goal at which the car has arrived, since navigation stops within a few decimetres."""
_STEP, _PATIENCE = 0.1, 5.0
"""A car that moves less than this in metres and seconds has stopped, not just turned or waited."""
_CROSS, _AHEAD, _BARB = 1.2, 1.8, 0.7
"""Finger widths: the cross, the arrow from its centre, and the arrow's barbs. Chosen by judgement."""


def goal_pose(shown: Pointed, map_from_base: Pose | None) -> Pose:
    """``map_from_goal`` (3,). A goal without a direction gets that of the straight line from the car's pose
    (3,). Raises UserError when the pose is unknown."""
    if shown.heading is not None:
        return np.array([*shown.place, shown.heading])
    if map_from_base is None:
        raise UserError("It is not known yet where the car is: wait for its first pose, then send a goal.")
    ahead = shown.place - map_from_base[:2]
    is_far = math.hypot(*ahead) > _THERE
    return np.array([*shown.place, math.atan2(ahead[1], ahead[0]) if is_far else map_from_base[2]])


class Goal:
    """Shown until the car has arrived."""

    def __init__(self, map_from_goal: Pose) -> None:
        self._map_from_goal = map_from_goal
        self._stood_at, self._since = np.full(2, np.nan), time.monotonic()
        self.is_reached = False

    def follow(self, map_from_base: Pose) -> str:
        """Update with the car's pose (3,); returns the progress, in words."""
        distance = math.hypot(*(self._map_from_goal - map_from_base)[:2])
        self.is_reached = self.is_reached or distance < _THERE
        if self.is_reached:
            return "The car is at the goal."
        if not np.hypot(*(map_from_base[:2] - self._stood_at)) < _STEP:
            self._stood_at, self._since = map_from_base[:2].copy(), time.monotonic()
        words = f"{distance:.1f} m to the goal."
        if time.monotonic() - self._since < _PATIENCE:
            return words
        return f"{words} The car stands; the log of the program that drives it may say why."

    def drawing(self, finger: float) -> NDArray[np.float64]:
        """(N, 2, 2) strokes for a ``finger`` width in metres on the floor: a cross at the goal, and an arrow
        in its direction; none once it is reached."""
        if self.is_reached:
            return np.zeros((0, 2, 2))
        x, y, yaw = self._map_from_goal
        place = np.array([x, y])
        ahead = place + _AHEAD * finger * np.array([math.cos(yaw), math.sin(yaw)])
        return np.concatenate([cross(place, _CROSS * finger), arrow(place, ahead, _BARB * finger)])
