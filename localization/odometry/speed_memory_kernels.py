"""How a measured step may err, by the speeds that odometry reported a moment ago."""

import math

import numpy as np
from numba import njit
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
        self._farthest, self._smooth = np.zeros(3), np.zeros(3)
        self._behind: Pose | None = None

    def take(self, step: Pose, seconds: float) -> tuple[Pose, NDArray[np.float64], Pose]:
        """Remember a step (3,) of so many seconds, and say what it may have been.

        That is how far the car may have gone in each coordinate (3,), how hard its tyres were pushed (2,),
        and what to add to the step (3,) for a car that follows its odometry with a delay.
        """
        if seconds == 0.0:
            return np.abs(step), np.zeros(2), IDENTITY
        if self._behind is None:
            self._behind = step / seconds
        return _follow_speeds(step, seconds, self._farthest, self._smooth, self._behind)


@njit(cache=True, nogil=True)
def tyre_effort(speed: Pose, next_speed: Pose, seconds: float) -> NDArray[np.float64]:
    """(2,) how hard the tyres were pushed along the car and across it, 0 to 1, between two speeds (3,)."""
    effort = np.empty(2)
    effort[0] = min(abs(next_speed[0] - speed[0]) / max(seconds, 1e-3) / _GRIP, 1.0)
    effort[1] = min(abs(next_speed[0] * next_speed[2]) / _GRIP, 1.0)
    return effort


@njit(cache=True, nogil=True)
def _follow_speeds(
    step: Pose, seconds: float, farthest: Pose, smooth: Pose, behind: Pose
) -> tuple[Pose, NDArray[np.float64], Pose]:
    """Take in a step (3,) of so many seconds: the speeds (3,) ``farthest``, ``smooth`` and ``behind`` follow.

    Returns how far the car may have gone in each coordinate (3,), the tyres' effort (2,), and what to add to
    the step for a car that is behind (3,).
    """
    possible, missing, before = np.empty(3), np.empty(3), smooth.copy()
    sliding_on = math.exp(-seconds / _SLIDE_SECONDS)
    for axis in range(3):
        speed = step[axis] / seconds
        sliding = farthest[axis] * sliding_on
        farthest[axis] = max(abs(speed), sliding if sliding >= _STANDING_SPEED else 0.0)
        smooth[axis] += min(1.0, seconds / _SMOOTH_SECONDS) * (speed - smooth[axis])
        behind[axis] -= math.expm1(-seconds / _LAG_SECONDS) * (speed - behind[axis])
        possible[axis] = farthest[axis] * seconds
        missing[axis] = behind[axis] * seconds - step[axis]
    return possible, tyre_effort(before, smooth, seconds), missing
