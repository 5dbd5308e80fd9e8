"""The reference loops for the localizer's speed."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose


@njit(cache=True, nogil=True)
def add_up_loads(places: NDArray[np.int64], offsets: NDArray[np.int64], codes: NDArray[np.uint8]) -> int:
    """The minimum that a sensor update must read: one byte for each particle and point.

    Addresses are known beforehand: the index (N,) of a particle in the flattened ``codes`` plus the offset
    (P,) of a point.
    """
    total = 0
    for i in range(len(places)):
        for point in range(len(offsets)):
            total += codes[places[i] + offsets[point]]
    return total


@njit(cache=True, nogil=True)
def march_rays(
    distances: NDArray[np.float32], starts: Pose, bearings: NDArray[np.float64], reach: float
) -> NDArray[np.float64]:
    """(N, B) cells to the nearest wall, at most ``reach``, from starts (N, 3) of column, row and heading.

    ``distances`` (rows, columns) are cells to the nearest wall, by which a ray can safely advance.
    """
    rows, columns = distances.shape
    ranges = np.empty((len(starts), len(bearings)))
    for i in range(len(starts)):
        for beam in range(len(bearings)):
            heading = starts[i, 2] + bearings[beam]
            cos, sin = math.cos(heading), math.sin(heading)
            gone = 0.0
            while gone < reach:
                column = math.floor(starts[i, 0] + gone * cos)
                row = math.floor(starts[i, 1] + gone * sin)
                if not (0 <= row < rows and 0 <= column < columns):
                    gone = reach
                    break
                leap = distances[row, column]
                if leap <= 0.0:
                    break
                gone += max(leap - 1.0, 1.0)  # one cell less, as both ends are somewhere within their cells
            ranges[i, beam] = min(gone, reach)
    return ranges


@njit(cache=True, nogil=True)
def spin(turns: int) -> int:
    """Work that uses neither memory nor the interpreter; its result is meaningless."""
    state = np.uint64(1)
    for _ in range(turns):
        state ^= state << np.uint64(13)
        state ^= state >> np.uint64(7)
        state ^= state << np.uint64(17)
    return int(state & np.uint64(1))
