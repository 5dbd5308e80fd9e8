"""What the localizer derives from a map before the first scan comes."""

from dataclasses import dataclass

from racecar.localization.floor.free_space import FreeSpace, find_free_space
from racecar.localization.floor.usable_map import refuse_empty, refuse_inverted
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


def survey(grid: OccupancyGrid) -> SurveyedMap:
    """Takes a moment on a large map.

    Raises UserError when the map has no free space or no walls, or seems to have one for the other.
    """
    refuse_empty(grid)
    walls = find_walls(grid)
    free_space = find_free_space(grid)
    refuse_inverted(walls, free_space)
    field, places = LikelihoodField(walls, free_space), PlaceSearch(free_space, walls)
    return SurveyedMap(walls, free_space, field, places)
