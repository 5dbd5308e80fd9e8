"""Whether a map can tell where a car is; a wrong entry in its YAML file makes one that only seems to."""

import numpy as np

from racecar.localization.floor.free_space import FreeSpace
from racecar.localization.floor.patches import strips
from racecar.localization.floor.walls import Walls
from racecar.maps.errors import UserError
from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM, UNKNOWN, OccupancyGrid

_INVERTED_WALL_SHARE = 0.9
"""Of the known cells, from which a map may be one whose colours mean the opposite. Measured: the walls of
nine maps of ours and of others take 0.01 to 0.07, and 0.97 to 0.995 when inverted."""
_INVERTED_WIDTH = 0.8
"""Metres; such a map is refused where its floor is nowhere wider. Measured: inverted, the walls of those nine
are 0.1 to 0.6 m wide at most, while their floors are wider than 2.7 m somewhere."""


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


def refuse_inverted(walls: Walls, free_space: FreeSpace) -> None:
    """Raises UserError when a map seems to have walls where it means floor and the other way round."""
    cells = walls.grid.cells
    occupied, known = np.count_nonzero(cells >= OCCUPIED_FROM), np.count_nonzero(cells > UNKNOWN)
    widest = 2.0 * float(walls.distances[free_space.is_open].max())
    if occupied > _INVERTED_WALL_SHARE * known and widest < _INVERTED_WIDTH:
        raise UserError(
            f"The map is {occupied / known:.0%} wall and its floor nowhere wider than {widest:.2f} m, as if "
            "walls were taken for floor and floor for walls; change negate in its YAML file, to 0 if it is 1."
        )
