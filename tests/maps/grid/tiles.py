"""Grids in one piece, cut into tiles."""

import numpy as np

from racecar.maps.grid.occupancy_grid import UNKNOWN, OccupancyGrid
from racecar.maps.grid.tiled_grid import TILE, TiledGrid, tiles_in


def in_tiles(grid: OccupancyGrid) -> TiledGrid:
    """The same grid; of tiles that are unknown as a whole, none is made."""
    rows, columns = grid.shape
    tiles = {}
    for tile in tiles_in(slice(0, rows), slice(0, columns)):
        row, column = tile.first_cell
        part = grid.cells[row : row + TILE, column : column + TILE]
        if (part != UNKNOWN).any():
            beyond = ((0, TILE - part.shape[0]), (0, TILE - part.shape[1]))
            tiles[tile] = np.pad(part, beyond, constant_values=UNKNOWN)
    return TiledGrid(tiles, rows, columns, grid.resolution, grid.map_from_grid)
