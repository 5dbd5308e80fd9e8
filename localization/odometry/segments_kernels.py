"""The loop over the ways that odometry may have told."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose


@njit(cache=True, nogil=True)
def go_on(told: NDArray[np.float64], step: Pose, little: float) -> None:
    """Append a step (3,) to each of four ways (4, 3), in place.

    To the first as it is, to the others with a little more way, more turn, and turn per metre.
    """
    for way in range(4):
        scale = 1.0 + little if way == 1 else 1.0
        x, y, turn = scale * step[0], scale * step[1], step[2]
        if way == 2:
            turn *= 1.0 + little
        if way == 3:
            turn += little * step[0]
        cos, sin = math.cos(told[way, 2]), math.sin(told[way, 2])
        told[way, 0] += cos * x - sin * y
        told[way, 1] += sin * x + cos * y
        told[way, 2] += turn
