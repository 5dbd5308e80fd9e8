"""Distance to the nearest wall."""

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.distance_field import distance_to_occupied
from racecar.maps.grid.occupancy_grid import OccupancyGrid

WallField = tuple[Pose, NDArray[np.float32], float, float]
"""Argument of kernels: ``map_from_grid`` (3,), metres to the centre of the nearest occupied cell (rows,
columns), cells per metre, and metres from a wall's surface to that centre."""


class Walls:
    """The distance field of a map."""

    def __init__(self, grid: OccupancyGrid) -> None:
        self.grid = grid
        self._map_from_grid = np.array(grid.map_from_grid)  # numba would recompile for a read-only array
        self.distances = distance_to_occupied(grid)
        """(rows, columns) metres from a cell's centre to that of the nearest occupied cell."""

    def field(self, surface: float) -> WallField:
        """The field of walls whose surface is ``surface`` metres before the centres of their cells."""
        return self._map_from_grid, self.distances, 1.0 / self.grid.resolution, surface
