"""Possible errors of a measured step, from the speeds that odometry reported shortly before."""

from math import exp, expm1

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import IDENTITY, Pose

_SLIDE_SECONDS = 0.2
"""Seconds after which the noise of a motion decays to a third: a car with locked wheels slides on. Chosen by
judgement."""
_STANDING_SPEED = 0.01
"""Metres or radians per second below which the car stands. Chosen by judgement: rounding in logs."""
_SMOOTH_SECONDS = 0.15
"""Seconds over which the speed is averaged to compute the force on the tyres, since differences of raw speeds
are mostly noise. Chosen by judgement."""
_LAG_SECONDS = 0.1
"""Time constant with which a car follows odometry computed from motor and servo commands. Measured by
comparing odometry with matched scans: on session_A and localization_bag1 turns and distances are 0.1 s
early."""
_GRIP = 4.0
"""Metres per second squared at which tyre slip saturates. Chosen by judgement: the friction of rubber on a
smooth floor is about 0.4 g."""


class SpeedMemory:
    """The recent speeds, some of them filtered."""

    def __init__(self) -> None:
        self._farthest: Pose = np.zeros(3)
        self._smooth: Pose = np.zeros(3)
        self._behind: Pose | None = None
        """(3,) speed of a car that follows its odometry with a delay."""

    def take(self, step: Pose, seconds: float) -> tuple[Pose, NDArray[np.float64], Pose]:
        """Add a step (3,) of this many seconds and return its possible errors.

        These are how far the car may have moved in each coordinate (3,), the tyres' effort (2,), and what to
        add to the step (3,) for a car that follows its odometry with a delay.
        """
        if seconds == 0.0:
            return np.abs(step), np.zeros(2), IDENTITY
        speed = step / seconds
        sliding = self._farthest * exp(-seconds / _SLIDE_SECONDS)
        self._farthest = np.maximum(np.abs(speed), np.where(sliding < _STANDING_SPEED, 0.0, sliding))
        behind = speed if self._behind is None else self._behind
        self._behind = behind - expm1(-seconds / _LAG_SECONDS) * (speed - behind)
        smooth = self._smooth
        self._smooth = smooth + min(seconds / _SMOOTH_SECONDS, 1.0) * (speed - smooth)
        possible, missing = self._farthest * seconds, self._behind * seconds - step
        return possible, tyre_effort(smooth, self._smooth, seconds), missing


def tyre_effort(speed: Pose, next_speed: Pose, seconds: float) -> NDArray[np.float64]:
    """(2,) effort of the tyres along and across the car, 0 to 1, between two speeds (3,)."""
    forward, _, turn = next_speed.tolist()
    along = abs(forward - float(speed[0])) / max(seconds, 1e-3)
    return np.minimum([along / _GRIP, abs(forward * turn) / _GRIP], 1.0)
