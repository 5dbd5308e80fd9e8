"""Samples of wheel odometry."""

import math
from dataclasses import dataclass

from racecar.maps.geometry.se2 import Pose

FASTEST, _LEAST_JUMP = 20.0, 0.5
"""Metres or radians, per second and at once. No small car moves faster, and half a metre more is granted
because messages that arrive in a bunch may be stamped as they arrive; by judgement, not measured."""


@dataclass(frozen=True, eq=False)
class Odometry:
    """One odometry message."""

    stamp: int
    """Nanoseconds."""
    odom_from_base: Pose
    """(3,) the pose by dead reckoning."""
    twist: Pose
    """(3,) forward, sideways (m/s) and turning speed (rad/s) in the base frame."""


def is_jump(odom_from_before: Pose, odom_from_after: Pose, seconds: float) -> bool:
    """Whether so little time between two poses (3,) shows that it was not the car that moved.

    Drivers that start anew count from zero, and some filters set their pose when they are told one.
    """
    most = FASTEST * seconds + _LEAST_JUMP
    x, y, turn = (odom_from_after - odom_from_before).tolist()
    return math.hypot(x, y) > most or abs(math.remainder(turn, math.tau)) > most
