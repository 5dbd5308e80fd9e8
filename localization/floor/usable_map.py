"""Whether a map can tell where a car is; a wrong entry in its YAML file makes one that only seems to."""

import numpy as np

from racecar.localization.floor.config import FreeSpaceConfig
from racecar.localization.floor.free_space import FreeSpace
from racecar.localization.floor.walls import Walls
from racecar.maps.errors import UserError
from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM, UNKNOWN


def refuse_unusable(walls: Walls, free_space: FreeSpace, config: FreeSpaceConfig) -> None:
    """Raises UserError when a map has no walls, or walls where it means floor and the other way round."""
    cells = walls.grid.cells
    occupied, known = np.count_nonzero(cells >= OCCUPIED_FROM), np.count_nonzero(cells > UNKNOWN)
    if occupied == 0:
        raise UserError(
            "The map has no wall, so nothing on it shows where the car is: no pixel is as dark as its "
            "occupied_thresh asks for; lower that, or save the image without transparency, which counts as "
            "brightness."
        )
    widest = 2.0 * float(walls.distances[free_space.is_open].max())
    if occupied > config.inverted_wall_share * known and widest < config.inverted_width:
        raise UserError(
            f"The map is {occupied / known:.0%} wall and its floor nowhere wider than {widest:.2f} m, as if "
            "walls were taken for floor and floor for walls; change negate in its YAML file, to 0 if it is 1."
        )
