"""Cells far from a path: the inner loop."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.grid.occupancy_grid import UNKNOWN


@njit(cache=True, nogil=True)
def forget_far_cells(
    cells: NDArray[np.int8], path: NDArray[np.int64], resolution: float, margin: float
) -> None:
    """Make unknown what of some cells (rows, columns) lies farther than ``margin`` from all cells (K, 2) of a
    path, row and column."""
    for row in range(cells.shape[0]):
        for column in range(cells.shape[1]):
            if cells[row, column] == UNKNOWN:
                continue
            is_near = False
            for k in range(len(path)):
                up, right = (row - path[k, 0]) * resolution, (column - path[k, 1]) * resolution
                if np.sqrt(up * up + right * right) <= margin:
                    is_near = True
                    break
            if not is_near:
                cells[row, column] = UNKNOWN
