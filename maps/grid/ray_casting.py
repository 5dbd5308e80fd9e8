"""Ranges that a laser would measure in a map, exact to the edges of cells.

Cells that are at least half occupied (``OCCUPIED_FROM``) stop a ray; unknown cells do not. A ray that starts
in an occupied cell measures 0, a ray without a hit inf.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from racecar.maps.geometry.se2 import Pose, between
from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM, OccupancyGrid


@njit(cache=True, nogil=True)
def _enter_grid(
    row: float, column: float, row_step: float, column_step: float, rows: int, columns: int
) -> tuple[float, float]:
    """First and last distance, in cells, at which the ray is over the grid; first > last when it never is."""
    first, last = 0.0, math.inf
    for start, step, size in ((row, row_step, rows), (column, column_step, columns)):
        if step == 0.0:
            if start < 0.0 or start >= size:
                return 1.0, 0.0
            continue
        near, far = -start / step, (size - start) / step
        if near > far:
            near, far = far, near
        first, last = max(first, near), min(last, far)
    return first, last


@njit(cache=True, nogil=True)
def cast_one(
    cells: NDArray[np.int8], row: float, column: float, row_step: float, column_step: float, reach: float
) -> float:
    """Distance in cells to the near edge of the first occupied cell; inf when none is within reach.

    (row, column) is the start in fractional cells, (row_step, column_step) the unit direction. J. Amanatides,
    A. Woo: A Fast Voxel Traversal Algorithm for Ray Tracing, Eurographics 1987.
    """
    rows, columns = cells.shape
    first, last = _enter_grid(row, column, row_step, column_step, rows, columns)
    if first > last:
        return math.inf
    distance = first
    # Rounding may put the entry slightly outside, so the cell is clamped to the grid.
    r = min(max(math.floor(row + first * row_step), 0), rows - 1)
    c = min(max(math.floor(column + first * column_step), 0), columns - 1)
    row_direction, row_spacing, next_row = 0, math.inf, math.inf
    if row_step != 0.0:
        row_direction = 1 if row_step > 0.0 else -1
        row_spacing = abs(1.0 / row_step)
        next_row = (r + (1 if row_step > 0.0 else 0) - row) / row_step
    column_direction, column_spacing, next_column = 0, math.inf, math.inf
    if column_step != 0.0:
        column_direction = 1 if column_step > 0.0 else -1
        column_spacing = abs(1.0 / column_step)
        next_column = (c + (1 if column_step > 0.0 else 0) - column) / column_step
    while distance <= reach:
        if cells[r, c] >= OCCUPIED_FROM:
            return distance
        if next_row < next_column:
            distance = next_row
            next_row += row_spacing
            r += row_direction
            if r < 0 or r >= rows:
                return math.inf
        else:
            distance = next_column
            next_column += column_spacing
            c += column_direction
            if c < 0 or c >= columns:
                return math.inf
    return math.inf


@njit(cache=True, nogil=True)
def cast_fans(
    cells: NDArray[np.int8],
    starts: NDArray[np.float64],
    bearings: NDArray[np.float64],
    reach: float,
    distances: NDArray[np.float64],
) -> None:
    """Fill distances (P, B): every bearing (B,) from every start (P, 3) of row, column, heading."""
    for p in range(starts.shape[0]):
        for b in range(bearings.shape[0]):
            heading = starts[p, 2] + bearings[b]
            distances[p, b] = cast_one(
                cells, starts[p, 0], starts[p, 1], math.sin(heading), math.cos(heading), reach
            )


@njit(cache=True, nogil=True)
def cast_beams(
    cells: NDArray[np.int8],
    starts: NDArray[np.float64],
    bearings: NDArray[np.float64],
    reach: float,
    distances: NDArray[np.float64],
) -> None:
    """Fill distances (N,): bearing i (N,) from start i (N, 3) of row, column, heading."""
    for i in range(starts.shape[0]):
        heading = starts[i, 2] + bearings[i]
        distances[i] = cast_one(
            cells, starts[i, 0], starts[i, 1], math.sin(heading), math.cos(heading), reach
        )


def cast_ray_fan(
    grid: OccupancyGrid, map_from_laser: ArrayLike, bearings: ArrayLike, max_range: float
) -> NDArray[np.float64]:
    """(P, B) metres: all bearings (B,) from each of the poses (P, 3); inf beyond ``max_range``."""
    starts, bearings = in_cells(grid, map_from_laser), np.ascontiguousarray(bearings, dtype=np.float64)
    distances = np.empty((len(starts), len(bearings)))
    cast_fans(grid.cells, starts, bearings, max_range / grid.resolution, distances)
    return distances * grid.resolution


def cast_rays(
    grid: OccupancyGrid, map_from_laser: ArrayLike, bearings: ArrayLike, max_range: float
) -> NDArray[np.float64]:
    """(N,) metres: bearing i of (N,) from pose i of (N, 3) or all from one (3,); inf beyond ``max_range``.

    One pose per bearing casts the sweep of a moving laser.
    """
    bearings = np.ascontiguousarray(bearings, dtype=np.float64)
    starts = np.broadcast_to(in_cells(grid, map_from_laser), (len(bearings), 3))
    distances = np.empty(len(bearings))
    cast_beams(grid.cells, np.ascontiguousarray(starts), bearings, max_range / grid.resolution, distances)
    return distances * grid.resolution


def in_cells(grid: OccupancyGrid, map_from_laser: ArrayLike) -> Pose:
    """(..., 3) fractional row, column and heading on the grid, of poses (..., 3)."""
    grid_from_laser = between(grid.map_from_grid, map_from_laser)
    starts = grid_from_laser[..., [1, 0, 2]] / np.array([grid.resolution, grid.resolution, 1.0])
    return np.ascontiguousarray(starts)
