"""How a measured step may err, by the speeds that odometry reported a moment ago."""

from math import exp, expm1

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import IDENTITY, Pose

_SLIDE_SECONDS = 0.2
"""By judgement: after which a third of the noise of a motion is left: with its wheels locked a car slides
on."""
_STANDING_SPEED = 0.01
"""By judgement: metres or radians per second below which the car stands: what a log's last digits make up."""
_SMOOTH_SECONDS = 0.15
"""By judgement: over which the speed is averaged that the force on the tyres is taken from, since differences
of raw speeds are mostly noise."""
_LAG_SECONDS = 0.1
"""The time constant by which a car follows odometry made of the commands to motor and servo; measured by
laying odometry beside matched scans: on session_A and localization_bag1 turns and distances are 0.1 s
early."""
_GRIP = 4.0
"""By judgement: metres per second squared at which tyres slip as much as they ever do: the friction of rubber
on a smooth floor is about 0.4 g."""


class SpeedMemory:
    """The speeds of which steps are made, some of them as they were."""

    def __init__(self) -> None:
        self._farthest: Pose = np.zeros(3)
        self._smooth: Pose = np.zeros(3)
        self._behind: Pose | None = None
        """(3,) of a car that follows its odometry with a delay."""

    def take(self, step: Pose, seconds: float) -> tuple[Pose, NDArray[np.float64], Pose]:
        """Remember a step (3,) of so many seconds, and say what it may have been.

        That is how far the car may have gone in each coordinate (3,), how hard its tyres were pushed (2,),
        and what to add to the step (3,) for a car that follows its odometry with a delay.
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
    """(2,) how hard the tyres were pushed along the car and across it, 0 to 1, between two speeds (3,)."""
    forward, _, turn = next_speed.tolist()
    along = abs(forward - float(speed[0])) / max(seconds, 1e-3)
    return np.minimum([along / _GRIP, abs(forward * turn) / _GRIP], 1.0)
