"""Crop a grid to the surroundings of the path."""

from dataclasses import replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.grid.occupancy_grid import UNKNOWN
from racecar.maps.grid.tiled_grid import TILE, TiledGrid


def near_path(grid: TiledGrid, path: NDArray[np.float64], margin: float) -> TiledGrid:
    """The grid with cells farther than ``margin`` metres from a path (K, 2) set to unknown."""
    path_cells = np.unique(grid.cell_of(path), axis=0)
    reach = margin / grid.resolution + 1.0  # plus one cell for rounding
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
    """Set cells (rows, columns) to unknown that are farther than ``margin`` from all cells (K, 2) of a path,
    row and column."""
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
