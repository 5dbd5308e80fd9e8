"""How well the end points of a scan fit the walls of a map, at many poses."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose

_HALF_FIT = 0.1
"""Metres from a wall at which the fit of a point is one half."""


@njit(cache=True, nogil=True)
def mean_fits(
    grid_from_base: Pose, points: NDArray[np.float64], distances: NDArray[np.float32], resolution: float
) -> NDArray[np.float64]:
    """(P,) mean fit of points (N, 2) of a base to walls at poses (P, 3): 1 on walls, 0 far away.

    ``distances`` (rows, columns) are metres to the nearest wall; points off the grid do not fit at all.
    """
    rows, columns = distances.shape
    fits = np.zeros(len(grid_from_base))
    for pose in range(len(grid_from_base)):
        x, y = grid_from_base[pose, 0] / resolution, grid_from_base[pose, 1] / resolution
        cos = math.cos(grid_from_base[pose, 2]) / resolution
        sin = math.sin(grid_from_base[pose, 2]) / resolution
        for point in range(len(points)):
            column = math.floor(x + cos * points[point, 0] - sin * points[point, 1])
            row = math.floor(y + sin * points[point, 0] + cos * points[point, 1])
            if 0 <= row < rows and 0 <= column < columns:
                fits[pose] += 1.0 / (1.0 + (distances[row, column] / _HALF_FIT) ** 2)
    return fits / max(len(points), 1)
