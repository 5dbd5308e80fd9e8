"""The loop over the paths that the car may have taken, for each fault of odometry and the laser's turn."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose


@njit(cache=True, nogil=True)
def append_step(ends: NDArray[np.float64], step: Pose, push: float, little: float) -> None:
    """Move the ends of six paths (6, 3) by a step (3,), in place.

    The first by the step as it is, the others by one with a little more distance, more turn, turn per metre,
    turn of the laser, and slip to the left where tyres are pushed across, by ``push`` (-1 to 1, to the left).
    Headings are not wrapped, for none gets far in a segment.
    """
    for path in range(6):
        scale = 1.0 + little if path == 1 else 1.0
        x, y, turn = scale * step[0], scale * step[1], step[2]
        if path == 2:
            turn *= 1.0 + little
        if path == 3:
            turn += little * step[0]
        if path == 4:
            x, y = x + little * y, y - little * x
        if path == 5:
            y += little * push * abs(x)
        cos, sin = math.cos(ends[path, 2]), math.sin(ends[path, 2])
        ends[path, 0] += cos * x - sin * y
        ends[path, 1] += sin * x + cos * y
        ends[path, 2] += turn
