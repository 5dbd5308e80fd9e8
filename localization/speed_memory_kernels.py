"""What the speeds of a moment ago say of a step that odometry measured."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from localization.slip_kernels import tyre_effort
from maps.se2 import Pose


@njit(cache=True, nogil=True)
def follow_speeds(
    step: Pose,
    seconds: float,
    farthest: Pose,
    smooth: Pose,
    behind: Pose,
    slide_seconds: float,
    standing: float,
    smooth_seconds: float,
    lag_seconds: float,
) -> tuple[Pose, NDArray[np.float64], Pose]:
    """Take in a step (3,) of so many seconds: the speeds (3,) ``farthest``, ``smooth`` and ``behind`` follow.

    Returns how far the car may have gone in each coordinate (3,), the tyres' effort (2,), and what to add to
    the step for a car that is behind (3,). Speeds under ``standing`` die at once.
    """
    possible, missing, before = np.empty(3), np.empty(3), smooth.copy()
    sliding_on = math.exp(-seconds / slide_seconds)
    for axis in range(3):
        told = step[axis] / seconds
        sliding = farthest[axis] * sliding_on
        farthest[axis] = max(abs(told), sliding if sliding >= standing else 0.0)
        smooth[axis] += min(1.0, seconds / smooth_seconds) * (told - smooth[axis])
        behind[axis] -= math.expm1(-seconds / lag_seconds) * (told - behind[axis])
        possible[axis] = farthest[axis] * seconds
        missing[axis] = behind[axis] * seconds - step[axis]
    return possible, tyre_effort(before, smooth, seconds), missing
