"""Walls of a grid as polylines along the middle of the occupied cells, as in a floor plan."""

import numpy as np
from numpy.typing import NDArray
from shapely import MultiLineString, get_parts, line_merge, linestrings, simplify
from skimage.morphology import skeletonize

from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM, OccupancyGrid

_STEPS = ((0, 1), (1, 0), (1, 1), (1, -1))
"""Row and column steps to half of a cell's eight neighbours, since each pair of neighbours is joined once."""


def wall_lines(grid: OccupancyGrid, tolerance: float | None = None) -> list[NDArray[np.float64]]:
    """Polylines (N, 2) in metres in the map; a closed one ends where it begins.

    Points of the skeleton (Zhang and Suen, "A fast parallel algorithm for thinning digital patterns", 1984)
    deviate from them by at most ``tolerance`` metres, one cell by default.
    """
    skeleton = np.pad(skeletonize(grid.cells >= OCCUPIED_FROM), 1)
    steps = np.concatenate([_joined(skeleton, *step) for step in _STEPS])
    merged = line_merge(MultiLineString(list(linestrings(_centres(grid, steps)))))
    lines = simplify(get_parts(merged), grid.resolution if tolerance is None else tolerance)
    return [*(np.array(line.coords) for line in lines), *_posts(grid, skeleton, steps)]


def _joined(skeleton: NDArray[np.bool_], rows: int, columns: int) -> NDArray[np.int64]:
    """(N, 2, 2) pairs of neighbouring skeleton cells, as row and column with a margin. Diagonal pairs are
    left out where a third cell connects both."""
    to = np.roll(skeleton, (-rows, -columns), axis=(0, 1))
    are = skeleton & to
    if rows and columns:
        are &= ~np.roll(skeleton, -rows, axis=0) & ~np.roll(skeleton, -columns, axis=1)
    cells = np.argwhere(are)
    return np.stack([cells, cells + np.array([rows, columns])], axis=1)


def _posts(
    grid: OccupancyGrid, skeleton: NDArray[np.bool_], steps: NDArray[np.int64]
) -> list[NDArray[np.float64]]:
    """Lines for isolated posts: thinning leaves a single cell and no line, so a line is drawn across it."""
    alone = skeleton.copy()
    rows, columns = steps.reshape(-1, 2).T
    alone[rows, columns] = False
    half = [0.0, 0.5]
    ends = np.stack([np.argwhere(alone) - half, np.argwhere(alone) + half], axis=1)
    return list(_centres(grid, ends))


def _centres(grid: OccupancyGrid, padded_cells: NDArray[np.generic]) -> NDArray[np.float64]:
    """(N, 2, 2) metres in the map of cells (N, 2, 2) counted with the margin."""
    return grid.center_of(np.asarray(padded_cells, dtype=np.float64).reshape(-1, 2) - 1).reshape(-1, 2, 2)
