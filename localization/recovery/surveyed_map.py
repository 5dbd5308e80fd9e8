"""What the localizer derives from a map before the first scan comes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.floor.free_space import FreeSpace, find_free_space
from racecar.localization.floor.range_table.range_codes import RangeCodes
from racecar.localization.floor.range_table.range_table import (
    RangeTable,
    affordable_cells,
    build_range_table,
)
from racecar.localization.floor.usable_map import refuse_empty, refuse_inverted
from racecar.localization.floor.walls import Walls, find_walls
from racecar.localization.recovery.place_search import PlaceSearch
from racecar.localization.sensor.beam_model import BeamModel
from racecar.maps.grid.occupancy_grid import OccupancyGrid


@dataclass(frozen=True, eq=False)
class SurveyedMap:
    """Where the car can be on a map, and what its laser would see from there."""

    walls: Walls
    free_space: FreeSpace
    table: RangeTable | RangeCodes
    """Expected ranges; only their codes where a table would take too much memory."""
    places: PlaceSearch
    shares_when_lost: NDArray[np.float64]
    """(K, 4) of beams that agree with the map in each way, at wrong places."""

    def beam_model(self, config: LocalizationConfig) -> BeamModel:
        """How likely scans are on this map."""
        return BeamModel(self.free_space, self.table, config.beam_model, config.squash)


def survey(grid: OccupancyGrid, config: LocalizationConfig) -> SurveyedMap:
    """Takes a second or two on a large map.

    Raises UserError when the map has no free space or no walls, or seems to have one for the other.
    """
    refuse_empty(grid)
    walls = find_walls(grid)
    affordable = affordable_cells(config.table_megabytes, config.range_table)
    free_space = find_free_space(grid, affordable, config.free_space)
    refuse_inverted(walls, free_space, config.free_space)
    table = build_range_table(free_space, config.table_megabytes, config.range_table)
    places = PlaceSearch(free_space, table, config.place_search)
    return SurveyedMap(walls, free_space, table, places, places.shares_when_lost(config.lost_detector))


def survey_settings(config: LocalizationConfig) -> tuple[object, ...]:
    """Those on which the survey depends."""
    return (
        config.table_megabytes,
        config.free_space,
        config.range_table,
        config.place_search,
        config.lost_detector,
    )
