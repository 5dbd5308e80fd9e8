"""Whether a map can tell where a car is; a wrong entry in its YAML file makes one that only seems to."""

import numpy as np

from racecar.localization.floor.config import FreeSpaceConfig
from racecar.localization.floor.free_space import FreeSpace
from racecar.localization.floor.patches import strips
from racecar.localization.floor.walls import Walls
from racecar.maps.errors import UserError
from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM, UNKNOWN, OccupancyGrid


def refuse_empty(grid: OccupancyGrid) -> None:
    """Raises UserError when a map has no free cells or no walls, before fields of its size are made."""
    parts = [grid.cells[rows] for rows in strips(grid.shape)]
    if not any(((part > UNKNOWN) & (part < OCCUPIED_FROM)).any() for part in parts):
        raise UserError("The map has no free cells, so a car can stand nowhere on it; check its thresholds.")
    if not any((part >= OCCUPIED_FROM).any() for part in parts):
        raise UserError(
            "The map has no wall, so nothing on it shows where the car is: no pixel is as dark as its "
            "occupied_thresh asks for; lower that, or save the image without transparency, which counts as "
            "brightness."
        )


def refuse_inverted(walls: Walls, free_space: FreeSpace, config: FreeSpaceConfig) -> None:
    """Raises UserError when a map seems to have walls where it means floor and the other way round."""
    cells = walls.grid.cells
    occupied, known = np.count_nonzero(cells >= OCCUPIED_FROM), np.count_nonzero(cells > UNKNOWN)
    widest = 2.0 * float(walls.distances[free_space.is_open].max())
    if occupied > config.inverted_wall_share * known and widest < config.inverted_width:
        raise UserError(
            f"The map is {occupied / known:.0%} wall and its floor nowhere wider than {widest:.2f} m, as if "
            "walls were taken for floor and floor for walls; change negate in its YAML file, to 0 if it is 1."
        )
