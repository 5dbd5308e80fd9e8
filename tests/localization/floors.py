"""What tests derive from a map."""

from racecar.localization.recovery.perception import Perception
from racecar.localization.recovery.surveyed_map import survey
from racecar.maps.grid.occupancy_grid import OccupancyGrid


def perception_of(grid: OccupancyGrid) -> Perception:
    return Perception(survey(grid))
