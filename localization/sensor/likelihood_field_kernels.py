"""Loops over particles and points of the likelihood field."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose


@njit(cache=True, nogil=True)
def grid_poses(map_from_base: Pose, grid_in_map: NDArray[np.float64]) -> NDArray[np.float32]:
    """(N, 4) column, row, cosine and sine of poses (N, 3) on the grid, in cells from its corner.

    ``grid_in_map`` is x, y, cos and sin of the grid's origin and cells per metre.
    """
    x0, y0, cos0, sin0, per_metre = grid_in_map
    on_grid = np.empty((len(map_from_base), 4), dtype=np.float32)
    for i in range(len(map_from_base)):
        x, y = map_from_base[i, 0] - x0, map_from_base[i, 1] - y0
        cos, sin = math.cos(map_from_base[i, 2]), math.sin(map_from_base[i, 2])
        on_grid[i, 0] = (cos0 * x + sin0 * y) * per_metre
        on_grid[i, 1] = (cos0 * y - sin0 * x) * per_metre
        on_grid[i, 2] = cos * cos0 + sin * sin0
        on_grid[i, 3] = sin * cos0 - cos * sin0
    return on_grid


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
def add_up_points(
    grid_from_base: NDArray[np.float32],
    points: NDArray[np.float32],
    laser: NDArray[np.float64],
    codes: NDArray[np.uint8],
    is_standable: NDArray[np.bool_],
    per_cell: int,
    log_by_code: NDArray[np.float32],
) -> NDArray[np.float64]:
    """(N,) sum of the log-likelihoods of points (P, 2) at poses on the field (N, 4), see `grid_poses`.

    Points and the laser (2,) are in pixels relative to the base. ``codes`` have a margin of one pixel for
    outside the map. Where the laser cannot be by ``is_standable``, whose cells are ``per_cell`` pixels wide,
    no point counts as on a wall.
    """
    rows, columns = codes.shape
    flat, count = codes.ravel(), len(points)
    x, y = points[:, 0].copy(), points[:, 1].copy()
    places = np.empty(count, dtype=np.int32)
    totals = np.empty(len(grid_from_base))
    outside = count * log_by_code[-2]
    last_column, last_row = np.float32(columns - 1), np.float32(rows - 1)
    for i in range(len(grid_from_base)):
        column, row, cos, sin = grid_from_base[i]
        laser_column = math.floor(column + cos * laser[0] - sin * laser[1])
        laser_row = math.floor(row + sin * laser[0] + cos * laser[1])
        is_on_map = 0 <= laser_row < rows - 2 and 0 <= laser_column < columns - 2
        if not is_on_map or not is_standable[laser_row // per_cell, laser_column // per_cell]:
            totals[i] = outside
            continue
        left, low = column + np.float32(1.0), row + np.float32(1.0)
        for k in range(count):
            c = min(max(left + cos * x[k] - sin * y[k], np.float32(0.0)), last_column)
            r = min(max(low + sin * x[k] + cos * y[k], np.float32(0.0)), last_row)
            places[k] = np.int32(r) * np.int32(columns) + np.int32(c)
        total = np.float32(0.0)
        for k in range(count):
            total += log_by_code[flat[places[k]]]
        totals[i] = total
    return totals


@njit(cache=True, nogil=True)
def mean_of_codes(
    grid_from_base: NDArray[np.float32],
    points: NDArray[np.float32],
    codes: NDArray[np.uint8],
    value_by_code: NDArray[np.float32],
) -> NDArray[np.float64]:
    """(P,) mean value of the codes of points (P, 2) over poses on the field (N, 4).

    NaN values are skipped; the mean is NaN for points with no other value. At poses off the map, the value is
    zero.
    """
    last_row, last_column = codes.shape[0] - 1, codes.shape[1] - 1
    sums, counts = np.zeros(len(points)), np.zeros(len(points))
    for i in range(len(grid_from_base)):
        column, row, cos, sin = grid_from_base[i]
        is_on_map = 0 <= row < last_row - 1 and 0 <= column < last_column - 1
        for k in range(len(points)):
            c = math.floor(column + cos * points[k, 0] - sin * points[k, 1]) + 1
            r = math.floor(row + sin * points[k, 0] + cos * points[k, 1]) + 1
            value = value_by_code[codes[min(max(r, 0), last_row), min(max(c, 0), last_column)]]
            says_nothing = math.isnan(value)
            sums[k] += 0.0 if says_nothing else value
            counts[k] += not (says_nothing and is_on_map)
    return np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)
