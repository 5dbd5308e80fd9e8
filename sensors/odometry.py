"""Samples of wheel odometry."""

import math
from dataclasses import dataclass

from racecar.maps.calls import checked
from racecar.maps.geometry.given_arrays import as_array
from racecar.maps.geometry.se2 import Pose

FASTEST, _LEAST_JUMP = 20.0, 0.5
"""Metres or radians, per second and at once. No small car moves faster; the half metre is for bursts of
messages stamped on arrival. Chosen by judgement: it was not measured."""


@checked
@dataclass(frozen=True, eq=False)
class Odometry:
    """One odometry message. Raises UserError when a shape is wrong."""

    stamp: int
    """Nanoseconds."""
    odom_from_base: Pose
    """(3,) pose by dead reckoning."""
    twist: Pose
    """(3,) forward and sideways velocity (m/s) and turn rate (rad/s) in the base frame."""

    def __post_init__(self) -> None:
        pose = as_array(self.odom_from_base, "The odom_from_base of odometry", (3,))
        object.__setattr__(self, "odom_from_base", pose)
        object.__setattr__(self, "twist", as_array(self.twist, "The twist of odometry", (3,)))


def is_jump(odom_from_before: Pose, odom_from_after: Pose, seconds: float) -> bool:
    """Whether the step between two poses (3,) is too large for the time: a reset, not motion.

    Restarted drivers count from zero, and some filters accept a new pose.
    """
    most = FASTEST * seconds + _LEAST_JUMP
    x, y, turn = (odom_from_after - odom_from_before).tolist()
    return math.hypot(x, y) > most or abs(math.remainder(turn, math.tau)) > most
