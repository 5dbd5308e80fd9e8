"""Despeckling: blobs of the size of a person that few keyframes saw may have been somebody walking by.

What crosses the view is looked through sooner or later and fades by itself. What is hidden again before that,
behind a door frame or a shelf, leaves its outline; nothing distinguishes it from a wall but that it is small,
isolated and was seen only briefly. Such cells become unknown.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, find_objects, label

from racecar.mapping.grid.config import DespecklingConfig
from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM, UNKNOWN, OccupancyGrid

_TOUCHING = np.ones((3, 3), dtype=np.bool_)
"""Cells that touch, or have one cell between them, are of one blob, because both grow by one to each side."""


def despeckled(
    grid: OccupancyGrid, returns: Sequence[NDArray[np.float64]], config: DespecklingConfig
) -> OccupancyGrid:
    """The grid with its specks unknown, by the returns (N, 2) in the map that each keyframe drew."""
    occupied = grid.cells >= OCCUPIED_FROM
    blobs, count = label(binary_dilation(occupied, _TOUCHING), _TOUCHING)
    blobs[~occupied] = 0
    looks = np.zeros(count + 1, dtype=np.int64)
    for points in returns:
        cells = grid.cell_of(points)
        rows, columns = cells[grid.contains(cells)].T  # a cropped grid has not all of them
        looks[np.unique(blobs[rows, columns])] += 1
    sizes = [max(s.stop - s.start for s in box) * grid.resolution for box in find_objects(blobs, count)]
    many = min(config.min_keyframes, len(returns) // 2)
    is_speck = np.append(False, (np.array(sizes) <= config.max_size) & (looks[1:] < many))
    return replace(grid, cells=np.where(is_speck[blobs], UNKNOWN, grid.cells).astype(np.int8))
