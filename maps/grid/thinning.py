"""A huge grid shown with fewer cells."""

import numpy as np

from racecar.maps.grid.occupancy_grid import UNKNOWN, OccupancyGrid
from racecar.maps.grid.raster import Raster

_STRIP = 512
"""Rows of a huge grid that are thinned at a time, to hold few of its cells at once."""


def thinning(grid: Raster, most_cells: int) -> int:
    """How many rows, and columns, become one where a grid is to have so many cells at most."""
    return max(1, int(np.ceil(np.sqrt(grid.size / most_cells))))


def thinned(grid: Raster, most_cells: int) -> OccupancyGrid:
    """With blocks of cells in place of a huge grid's; a block shows its most occupied cell."""
    step = thinning(grid, most_cells)
    rows, columns = grid.shape
    blocks = np.full((-(-rows // step), -(-columns // step)), UNKNOWN, dtype=np.int8)
    strip = step * max(1, _STRIP // step)
    for first in range(0, rows, strip):
        cells = grid.rows(first, min(first + strip, rows))
        for row in range(min(step, len(cells))):
            for column in range(min(step, columns)):
                part = cells[row::step, column::step]
                shown = blocks[first // step : first // step + part.shape[0], : part.shape[1]]
                np.maximum(shown, part, out=shown)
    return OccupancyGrid(blocks, step * grid.resolution, grid.map_from_grid)
