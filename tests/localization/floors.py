"""What tests derive from a map, with the default settings."""

from racecar.localization.config import LocalizationConfig
from racecar.localization.floor.free_space import FreeSpace, find_free_space
from racecar.localization.recovery.perception import Perception
from racecar.localization.recovery.surveyed_map import survey
from racecar.maps.grid.occupancy_grid import OccupancyGrid

CONFIG = LocalizationConfig()


def free_space_of(grid: OccupancyGrid) -> FreeSpace:
    return find_free_space(grid, CONFIG.free_space)


def perception_of(grid: OccupancyGrid) -> Perception:
    return Perception(survey(grid, CONFIG.free_space), CONFIG)
