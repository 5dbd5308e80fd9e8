"""The loop over end points that tells on which side of a wall they lie."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose

_NEAREST = 4.0
"""Cells to the laser, since nearer points tell no direction. By judgement."""


@njit(cache=True, nogil=True)
def signed_distances(
    pose: Pose,
    grid_from_map: Pose,
    points: NDArray[np.float64],
    laser: Pose,
    distances: NDArray[np.float32],
    resolution: float,
) -> NDArray[np.float64]:
    """(N,) metres from points (N, 2) to centres of walls, negative behind them as the laser (3,) sees them.

    Inf outside the field of ``distances`` (rows, columns) and too near the laser.
    """
    signed = np.full(len(points), np.inf)
    cos, sin = math.cos(grid_from_map[2] + pose[2]), math.sin(grid_from_map[2] + pose[2])
    turn_cos, turn_sin = math.cos(grid_from_map[2]), math.sin(grid_from_map[2])
    right = (grid_from_map[0] + turn_cos * pose[0] - turn_sin * pose[1]) / resolution - 0.5
    up = (grid_from_map[1] + turn_sin * pose[0] + turn_cos * pose[1]) / resolution - 0.5
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        dx, dy = x - laser[0], y - laser[1]
        r = math.sqrt(dx * dx + dy * dy)
        if r < _NEAREST * resolution:
            continue
        column, row = right + (cos * x - sin * y) / resolution, up + (sin * x + cos * y) / resolution
        step_c, step_r = (cos * dx - sin * dy) / r, (sin * dx + cos * dy) / r
        here = _at(distances, column, row)
        before = _at(distances, column - step_c, row - step_r)
        behind = _at(distances, column + step_c, row + step_r)
        if here < 0.0 or before < 0.0 or behind < 0.0:
            continue
        signed[i] = here if before > behind else -here
    return signed


@njit(cache=True, nogil=True)
def _at(distances: NDArray[np.float32], column: float, row: float) -> float:
    left, low = math.floor(column), math.floor(row)
    if not (0 <= left < distances.shape[1] - 1 and 0 <= low < distances.shape[0] - 1):
        return -1.0
    u, v = column - left, row - low
    lower = distances[low, left] + u * (distances[low, left + 1] - distances[low, left])
    upper = distances[low + 1, left] + u * (distances[low + 1, left + 1] - distances[low + 1, left])
    return float(lower + v * (upper - lower))
