"""Distance from each cell to the nearest obstacle."""

import math

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import map_coordinates

from racecar.maps.geometry.se2 import inverse, transform_points
from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM, OccupancyGrid


def distance_to_occupied(grid: OccupancyGrid) -> NDArray[np.float32]:
    """(rows, columns) metres from each cell's centre to that of the nearest occupied cell.

    On a grid without occupied cells, the grid's diagonal.
    """
    occupied = grid.cells >= OCCUPIED_FROM
    if not occupied.any():
        return np.full(occupied.shape, np.hypot(*occupied.shape) * grid.resolution, dtype=np.float32)
    distances = np.empty(occupied.shape, dtype=np.float32)
    fill_distances(occupied, grid.resolution, distances)
    return distances


def sample_field(
    field: NDArray[np.float32], grid: OccupancyGrid, points_in_map: ArrayLike
) -> NDArray[np.float32]:
    """(N,) values of a field (rows, columns) at points (N, 2), bilinear between cell centres.

    Points outside the grid take the value of the nearest edge cell.
    """
    points_in_grid = transform_points(inverse(grid.map_from_grid), points_in_map)
    rows_and_columns = points_in_grid[:, ::-1].T / grid.resolution - 0.5
    sampled: NDArray[np.float32] = map_coordinates(field, rows_and_columns, order=1, mode="nearest")
    return sampled


@njit(cache=True, nogil=True)
def fill_distances(is_source: NDArray[np.bool_], spacing: float, distances: NDArray[np.float32]) -> None:
    """Fill distances (rows, columns) from each cell's centre to that of the nearest source; cells are
    ``spacing`` apart. At least one source is required.

    A. Meijster, J. B. T. M. Roerdink, W. H. Hesselink: A general algorithm for computing distance transforms
    in linear time, Mathematical Morphology and its Applications, 2000. It works in place; SciPy's needs 24
    bytes more per cell.
    """
    rows, columns = is_source.shape
    beyond = rows + columns
    for row in range(rows):  # first the cells to the nearest source in the same column: a 32-bit float holds
        for column in range(columns):  # integers up to 16 million exactly
            if is_source[row, column]:
                distances[row, column] = 0
            elif row == 0:
                distances[row, column] = beyond
            else:
                distances[row, column] = min(distances[row - 1, column] + 1, beyond)
    for row in range(rows - 2, -1, -1):
        for column in range(columns):
            below = distances[row + 1, column] + 1
            if below < distances[row, column]:
                distances[row, column] = below
    heights = np.empty(columns, dtype=np.int64)
    nearest = np.empty(columns, dtype=np.int64)
    since = np.empty(columns, dtype=np.int64)
    for row in range(rows):
        for column in range(columns):
            heights[column] = np.int64(distances[row, column])
        last = _lower_envelope(heights, nearest, since)
        for column in range(columns - 1, -1, -1):
            along, across = spacing * (nearest[last] - column), spacing * heights[nearest[last]]
            distances[row, column] = math.sqrt(across * across + along * along)
            if column == since[last]:
                last -= 1


@njit(cache=True, nogil=True)
def _lower_envelope(heights: NDArray[np.int64], nearest: NDArray[np.int64], since: NDArray[np.int64]) -> int:
    """Lower envelope of parabolas: column ``nearest[k]`` from column ``since[k]`` on. Returns the last k."""
    last = 0
    nearest[0] = since[0] = 0
    for column in range(1, len(heights)):
        height = heights[column] ** 2
        while last >= 0:
            start, best = since[last], nearest[last]
            if (start - best) ** 2 + heights[best] ** 2 <= (start - column) ** 2 + height:
                break
            last -= 1
        if last < 0:
            last = 0
            nearest[0] = column
            continue
        best = nearest[last]
        first = 1 + (column**2 - best**2 + height - heights[best] ** 2) // (2 * (column - best))
        if first < len(heights):
            last += 1
            nearest[last] = column
            since[last] = first
    return last
