"""What the speeds of a moment ago say of a step that odometry measured."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.localization.odometry.slip_kernels import tyre_effort
from racecar.maps.geometry.se2 import Pose

_SLIDE_SECONDS = 0.2
"""How fast the noise of a motion dies away: with its wheels locked a car slides on."""
_STANDING = 0.01
"""Metres or radians per second below which a car stands."""
_SMOOTH_SECONDS = 0.15
_LAG_SECONDS = 0.1
"""How fast a car follows its odometry, where that knows what servo and motor are told to do."""


@njit(cache=True, nogil=True)
def follow_speeds(
    step: Pose, seconds: float, farthest: Pose, smooth: Pose, behind: Pose
) -> tuple[Pose, NDArray[np.float64], Pose]:
    """Take in a step (3,) of so many seconds: the speeds (3,) ``farthest``, ``smooth`` and ``behind`` follow.

    Returns how far the car may have gone in each coordinate (3,), the tyres' effort (2,), and what to add to
    the step for a car that is behind (3,).
    """
    possible, missing, before = np.empty(3), np.empty(3), smooth.copy()
    sliding_on = math.exp(-seconds / _SLIDE_SECONDS)
    for axis in range(3):
        told = step[axis] / seconds
        sliding = farthest[axis] * sliding_on
        farthest[axis] = max(abs(told), sliding if sliding >= _STANDING else 0.0)
        smooth[axis] += min(1.0, seconds / _SMOOTH_SECONDS) * (told - smooth[axis])
        behind[axis] -= math.expm1(-seconds / _LAG_SECONDS) * (told - behind[axis])
        possible[axis] = farthest[axis] * seconds
        missing[axis] = behind[axis] * seconds - step[axis]
    return possible, tyre_effort(before, smooth, seconds), missing
