"""How often a closed line winds around each cell of a grid."""

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.closed_line import closed, resampled_ring
from racecar.maps.grid.raster import Raster


def winding_numbers(grid: Raster, ring: NDArray[np.float64]) -> NDArray[np.int32]:
    """(rows, columns) rounds that a closed line (N, 2) in metres makes around each cell, anticlockwise in the
    grid; on the line's left the number is greater by one than on its right."""
    rows, columns = grid.raster_of(closed(resampled_ring(ring, grid.resolution / 2))).T
    above = np.ceil(rows).astype(np.int64)  # steps are half a cell, so each enters at most one row
    row = np.minimum(above[:-1], above[1:])
    column = np.floor((columns[:-1] + columns[1:]) / 2).astype(np.int64)
    numbers = np.zeros(grid.shape, dtype=np.int32)
    on_grid = (row >= 0) & (row < grid.shape[0]) & (column >= 0)
    places = row[on_grid], np.minimum(column[on_grid], grid.shape[1] - 1)
    np.add.at(numbers, places, np.diff(above)[on_grid])
    rounds: NDArray[np.int32] = np.cumsum(numbers[:, ::-1], axis=1, dtype=np.int32)[:, ::-1]
    return rounds
