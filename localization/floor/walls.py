"""How far it is to the nearest wall."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, inverse
from racecar.maps.grid.distance_field import distance_to_occupied
from racecar.maps.grid.occupancy_grid import OccupancyGrid


@dataclass(frozen=True, eq=False)
class Walls:
    """The distance field of a map."""

    grid: OccupancyGrid
    distances: NDArray[np.float32]
    """(rows, columns) metres from a cell's centre to that of the nearest occupied cell."""
    grid_from_map: Pose


def find_walls(grid: OccupancyGrid) -> Walls:
    """The walls of a map."""
    return Walls(grid, distance_to_occupied(grid), inverse(grid.map_from_grid))
