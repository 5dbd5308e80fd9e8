"""The part of a map that a picture shows: what is known and the path, without specks far away."""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from racecar.maps.grid.occupancy_grid import UNKNOWN, OccupancyGrid
from racecar.maps.grid.thinning import thinning

_MOST_CELLS = 8_000_000
"""Cells looked at; of a huge grid an even sample."""
_MARGIN = 1.0
"""Metres around what is shown."""
_APART = 1.0
"""Metres without a known cell that separate a speck. Chosen by judgement: the beams of a sparse laser meet a
wall closer together than twice that."""
_SPECK = 0.02
"""Share of the largest part of the map below which a separate part is a speck, such as the far wall that a
few beams reached through a window. Chosen by judgement."""


def shown_area(
    grid: OccupancyGrid, places: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower left and upper right corner (2,) in metres, with ``places`` (N, 2) inside."""
    inside = np.vstack([grid.center_of(_cells_without_specks(grid)), places])
    return inside.min(axis=0) - _MARGIN, inside.max(axis=0) + _MARGIN


def known_cells(grid: OccupancyGrid) -> NDArray[np.int64]:
    """(N, 2) row and column of the known cells; for a huge grid, an even sample."""
    step = thinning(grid, _MOST_CELLS)
    return step * np.argwhere(grid.cells[::step, ::step] != UNKNOWN)


def _cells_without_specks(grid: OccupancyGrid) -> NDArray[np.int64]:
    """(N, 2) known cells."""
    known = known_cells(grid)
    if not len(known):
        return known
    blocks = (known * grid.resolution / _APART).astype(np.int64)
    first = blocks.min(axis=0)
    is_known = np.zeros(blocks.max(axis=0) - first + 1, dtype=np.bool_)
    is_known[tuple((blocks - first).T)] = True
    labels, _ = ndimage.label(is_known, structure=np.ones((3, 3)))
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    label_of_cell = labels[tuple((blocks - first).T)]
    is_speck = sizes[label_of_cell] < _SPECK * sizes.max()
    return np.asarray(known[~is_speck])
