"""Downsample a huge grid for display."""

import numpy as np

from racecar.maps.grid.occupancy_grid import UNKNOWN, OccupancyGrid
from racecar.maps.grid.raster import Raster

_STRIP = 512
"""Rows thinned at a time, so that only few cells of a huge grid are in memory at once."""


def thinning(grid: Raster, most_cells: int) -> int:
    """Downsampling factor per axis at which a grid has at most ``most_cells`` cells."""
    return max(1, int(np.ceil(np.sqrt(grid.size / most_cells))))


def thinned(grid: Raster, most_cells: int) -> OccupancyGrid:
    """A huge grid in blocks of cells; each block shows its most occupied cell."""
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
