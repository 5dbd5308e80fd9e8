"""Gauss-Newton on the distance to walls."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from maps.se2 import Pose

_SCALES = (0.3, 0.2, 0.1, 0.1, 0.07, 0.07)
"""Metres beyond which a point counts less and less; one step each."""
_WALL_NOISE = 0.05
_START_NOISE = 0.3
"""Metres and radians: how strongly points on walls and the start hold the pose."""


@njit(cache=True, nogil=True)
def align_to_walls(
    grid_from_base: Pose,
    points_in_base: NDArray[np.float64],
    distances: NDArray[np.float32],
    resolution: float,
) -> Pose:
    """The pose (3,) near a start that brings points (N, 2) to the walls' surfaces.

    ``distances`` (rows, columns) are metres to the centre of the nearest occupied cell. In drawn maps the
    surface is half a cell before that, in maps made from scans it is there: a quarter is between.
    Weights of Geman and McClure; the start holds the pose where walls do not, as along a corridor.
    """
    pose = grid_from_base.copy()
    for scale in _SCALES:
        information = np.eye(3) / _START_NOISE**2
        gradient = (pose - grid_from_base) / _START_NOISE**2
        cos, sin = math.cos(pose[2]), math.sin(pose[2])
        for i in range(len(points_in_base)):
            dx = cos * points_in_base[i, 0] - sin * points_in_base[i, 1]
            dy = sin * points_in_base[i, 0] + cos * points_in_base[i, 1]
            distance, slope_x, slope_y = _sample(
                distances, (pose[0] + dx) / resolution - 0.5, (pose[1] + dy) / resolution - 0.5
            )
            if distance < 0.0:
                continue
            distance = max(distance - 0.25 * resolution, 0.0)
            weight = 1.0 / ((1.0 + (distance / scale) ** 2) ** 2 * _WALL_NOISE**2)
            jacobian = np.array([slope_x, slope_y, slope_y * dx - slope_x * dy])
            jacobian[0] /= resolution
            jacobian[1] /= resolution
            jacobian[2] /= resolution
            for row in range(3):
                gradient[row] += weight * jacobian[row] * distance
                for column in range(3):
                    information[row, column] += weight * jacobian[row] * jacobian[column]
        pose -= np.linalg.solve(information, gradient)
    return pose


@njit(cache=True, nogil=True)
def _sample(distances: NDArray[np.float32], column: float, row: float) -> tuple[float, float, float]:
    """Bilinear distance and its slopes per column and row; a distance of -1 outside the field."""
    left, low = math.floor(column), math.floor(row)
    if not (0 <= left < distances.shape[1] - 1 and 0 <= low < distances.shape[0] - 1):
        return -1.0, 0.0, 0.0
    u, v = column - left, row - low
    a, b = distances[low, left], distances[low, left + 1]
    c, d = distances[low + 1, left], distances[low + 1, left + 1]
    distance = (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d)
    return distance, (1 - v) * (b - a) + v * (d - c), (1 - u) * (c - a) + u * (d - b)
