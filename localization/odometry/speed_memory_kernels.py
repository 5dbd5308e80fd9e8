"""How a measured step may err, by the speeds that odometry reported a moment ago."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.localization.odometry.config import SpeedMemoryConfig
from racecar.maps.geometry.se2 import IDENTITY, Pose


class _Rates(NamedTuple):
    """The settings, as a kernel takes them."""

    slide_seconds: float
    standing_speed: float
    smooth_seconds: float
    lag_seconds: float
    grip: float


class SpeedMemory:
    """The speeds of which steps are made, some of them as they were."""

    def __init__(self, config: SpeedMemoryConfig) -> None:
        self._farthest, self._smooth = np.zeros(3), np.zeros(3)
        self._behind: Pose | None = None
        self.reconfigure(config)

    def reconfigure(self, config: SpeedMemoryConfig) -> None:
        """Take other settings from here on."""
        self._rates = _Rates(**config.model_dump())

    def take(self, step: Pose, seconds: float) -> tuple[Pose, NDArray[np.float64], Pose]:
        """Remember a step (3,) of so many seconds, and say what it may have been.

        That is how far the car may have gone in each coordinate (3,), how hard its tyres were pushed (2,),
        and what to add to the step (3,) for a car that follows its odometry with a delay.
        """
        if seconds == 0.0:
            return np.abs(step), np.zeros(2), IDENTITY
        if self._behind is None:
            self._behind = step / seconds
        return _follow_speeds(step, seconds, self._farthest, self._smooth, self._behind, self._rates)


@njit(cache=True, nogil=True)
def tyre_effort(speed: Pose, next_speed: Pose, seconds: float, grip: float) -> NDArray[np.float64]:
    """(2,) how hard the tyres were pushed along the car and across it, 0 to 1, between two speeds (3,).

    Tyres are pushed fully at an acceleration of ``grip``, in m/s².
    """
    effort = np.empty(2)
    effort[0] = min(abs(next_speed[0] - speed[0]) / max(seconds, 1e-3) / grip, 1.0)
    effort[1] = min(abs(next_speed[0] * next_speed[2]) / grip, 1.0)
    return effort


@njit(cache=True, nogil=True)
def _follow_speeds(
    step: Pose, seconds: float, farthest: Pose, smooth: Pose, behind: Pose, rates: _Rates
) -> tuple[Pose, NDArray[np.float64], Pose]:
    """Take in a step (3,) of so many seconds: the speeds (3,) ``farthest``, ``smooth`` and ``behind`` follow.

    Returns how far the car may have gone in each coordinate (3,), the tyres' effort (2,), and what to add to
    the step for a car that is behind (3,).
    """
    possible, missing, before = np.empty(3), np.empty(3), smooth.copy()
    sliding_on = math.exp(-seconds / rates.slide_seconds)
    for axis in range(3):
        speed = step[axis] / seconds
        sliding = farthest[axis] * sliding_on
        farthest[axis] = max(abs(speed), sliding if sliding >= rates.standing_speed else 0.0)
        smooth[axis] += min(1.0, seconds / rates.smooth_seconds) * (speed - smooth[axis])
        behind[axis] -= math.expm1(-seconds / rates.lag_seconds) * (speed - behind[axis])
        possible[axis] = farthest[axis] * seconds
        missing[axis] = behind[axis] * seconds - step[axis]
    return possible, tyre_effort(before, smooth, seconds, rates.grip), missing
