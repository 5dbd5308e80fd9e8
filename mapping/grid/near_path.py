"""What lies near the path that was driven, and nothing else."""

from dataclasses import replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.grid.occupancy_grid import UNKNOWN
from racecar.maps.grid.tiled_grid import TILE, TiledGrid


def near_path(grid: TiledGrid, path: NDArray[np.float64], margin: float) -> TiledGrid:
    """The grid without what lies farther than ``margin`` metres from the points of a path (K, 2)."""
    path_cells = np.unique(grid.cell_of(path), axis=0)
    reach = margin / grid.resolution + 1.0  # and a cell for rounding
    tiles = {}
    for tile, cells in grid.tiles.items():
        first = np.array(tile.first_cell)
        beside = np.maximum(np.maximum(first - path_cells, path_cells - (first + TILE - 1)), 0)
        near = path_cells[np.hypot(beside[:, 0], beside[:, 1]) <= reach]
        if len(near) > 0:
            tiles[tile] = cells.copy()
            _forget_far_cells(tiles[tile], near - first, grid.resolution, margin)
    return replace(grid, tiles=tiles)


@njit(cache=True, nogil=True)
def _forget_far_cells(
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
