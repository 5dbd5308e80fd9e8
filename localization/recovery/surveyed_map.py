"""What the localizer derives from a map before the first scan comes."""

from dataclasses import dataclass

from racecar.localization.floor.config import FreeSpaceConfig
from racecar.localization.floor.free_space import FreeSpace, find_free_space
from racecar.localization.floor.usable_map import refuse_unusable
from racecar.localization.floor.walls import Walls, find_walls
from racecar.localization.recovery.place_search import PlaceSearch
from racecar.localization.sensor.likelihood_field import LikelihoodField
from racecar.maps.grid.occupancy_grid import OccupancyGrid


@dataclass(frozen=True, eq=False)
class SurveyedMap:
    """Where the car can be on a map, and how near each place is to a wall."""

    walls: Walls
    free_space: FreeSpace
    field: LikelihoodField
    places: PlaceSearch


def survey(grid: OccupancyGrid, config: FreeSpaceConfig) -> SurveyedMap:
    """Takes a moment on a large map.

    Raises UserError when the map has no free space or no walls, or seems to have one for the other.
    """
    walls = find_walls(grid)
    free_space = find_free_space(grid, config)
    refuse_unusable(walls, free_space, config)
    field = LikelihoodField(walls, free_space)
    return SurveyedMap(walls, free_space, field, PlaceSearch(free_space, field))
