"""How a measured step may err, by the speeds that odometry told a moment ago."""

import numpy as np
from numpy.typing import NDArray

from racecar.localization.odometry.speed_memory_kernels import follow_speeds
from racecar.maps.geometry.se2 import IDENTITY, Pose


class SpeedMemory:
    """The speeds of which steps are made, some of them as they were."""

    def __init__(self) -> None:
        self._farthest, self._smooth = np.zeros(3), np.zeros(3)
        self._behind: Pose | None = None

    def take(self, step: Pose, seconds: float) -> tuple[Pose, NDArray[np.float64], Pose]:
        """Remember a step (3,) of so many seconds, and tell what it may have been.

        That is how far the car may have gone in each coordinate (3,), how hard its tyres were pushed (2,),
        and what to add to the step (3,) for a car that does only by and by what its odometry says.
        """
        if seconds == 0.0:
            return np.abs(step), np.zeros(2), IDENTITY
        if self._behind is None:
            self._behind = step / seconds
        return follow_speeds(step, seconds, self._farthest, self._smooth, self._behind)
