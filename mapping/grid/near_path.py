"""What lies near the path that was driven, and nothing else."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.grid.near_path_kernels import forget_far_cells
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
            forget_far_cells(tiles[tile], near - first, grid.resolution, margin)
    return replace(grid, tiles=tiles)
