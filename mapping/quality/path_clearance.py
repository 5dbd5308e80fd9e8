"""Does the path lead through what the map shows as occupied?"""

import numpy as np

from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM, OccupancyGrid

_SPACING = 0.1
"""Metres between the places of the path that are looked at, so that no wall of two cells is missed."""


def share_through_obstacles(map_from_base: Pose, grid: OccupancyGrid) -> float:
    """Share of the places along a path (N, 3) that lie in occupied cells."""
    driven = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(map_from_base[:, :2], axis=0).T))])
    _, chosen = np.unique((driven / _SPACING).astype(np.int64), return_index=True)
    cells = grid.cell_of(map_from_base[chosen, :2])
    rows, columns = cells[grid.contains(cells)].T
    return float(np.sum(grid.cells[rows, columns] >= OCCUPIED_FROM)) / len(chosen)
