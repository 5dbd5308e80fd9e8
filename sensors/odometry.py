"""Samples of wheel odometry."""

import math
from dataclasses import dataclass

from racecar.maps.geometry.se2 import Pose

FASTEST, _LEAST_JUMP = 20.0, 0.5
"""Metres or radians, per second and at once. No small car moves faster; the half metre is for bursts of
messages stamped on arrival. Chosen by judgement: it was not measured."""


@dataclass(frozen=True, eq=False)
class Odometry:
    """One odometry message."""

    stamp: int
    """Nanoseconds."""
    odom_from_base: Pose
    """(3,) pose by dead reckoning."""
    twist: Pose
    """(3,) forward and sideways velocity (m/s) and turn rate (rad/s) in the base frame."""


def is_jump(odom_from_before: Pose, odom_from_after: Pose, seconds: float) -> bool:
    """Whether the step between two poses (3,) is too large for the time: a reset, not motion.

    Restarted drivers count from zero, and some filters accept a new pose.
    """
    most = FASTEST * seconds + _LEAST_JUMP
    x, y, turn = (odom_from_after - odom_from_before).tolist()
    return math.hypot(x, y) > most or abs(math.remainder(turn, math.tau)) > most
