"""Specks: blobs of the size of a person that few keyframes saw, which may have been somebody walking by.

What crosses the view is looked through sooner or later and fades by itself. What is hidden again before that,
behind a door frame or a shelf, leaves its outline; nothing tells it from a wall but that it is small, stands
alone and was seen for a moment. Such cells are told as unknown.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, find_objects, label

from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM, UNKNOWN, OccupancyGrid

_LARGEST = 0.6
"""Metres, of the longer side."""
_MANY_LOOKS = 8
"""Keyframes, at least, that what is held for real was seen from."""
_ALONE = np.ones((3, 3), dtype=np.bool_)
"""Cells that touch, or have one cell between them, are of one blob: both grow by one to each side."""


def without_specks(grid: OccupancyGrid, returns: Sequence[NDArray[np.float64]]) -> OccupancyGrid:
    """The grid whose specks are unknown, from the returns (N, 2) in the map that each keyframe drew."""
    occupied = grid.cells >= OCCUPIED_FROM
    blobs, count = label(binary_dilation(occupied, _ALONE), _ALONE)
    blobs[~occupied] = 0
    looks = np.zeros(count + 1, dtype=np.int64)
    for points in returns:
        rows, columns = grid.cell_of(points).T
        looks[np.unique(blobs[rows, columns])] += 1
    sizes = [max(s.stop - s.start for s in box) * grid.resolution for box in find_objects(blobs, count)]
    many = min(_MANY_LOOKS, len(returns) // 2)
    is_speck = np.append(False, (np.array(sizes) <= _LARGEST) & (looks[1:] < many))
    return replace(grid, cells=np.where(is_speck[blobs], UNKNOWN, grid.cells).astype(np.int8))
