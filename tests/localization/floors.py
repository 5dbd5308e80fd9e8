"""What tests derive from a map, with the default settings."""

from racecar.localization.config import LocalizationConfig
from racecar.localization.floor.free_space import FreeSpace, find_free_space
from racecar.localization.floor.range_table.range_codes import RangeCodes, range_codes
from racecar.localization.floor.range_table.range_table import RangeTable, build_range_table
from racecar.localization.sensor.beam_model import BeamModel
from racecar.maps.grid.occupancy_grid import OccupancyGrid

CONFIG = LocalizationConfig()
CODES: RangeCodes = range_codes(CONFIG.range_table.longest_range)


def free_space_of(grid: OccupancyGrid, max_cells: int = 10**6) -> FreeSpace:
    return find_free_space(grid, max_cells, CONFIG.free_space)


def table_of(free_space: FreeSpace, megabytes: int = 50) -> RangeTable:
    table = build_range_table(free_space, megabytes, CONFIG.range_table)
    assert isinstance(table, RangeTable)
    return table


def beam_model_of(free_space: FreeSpace, with_table: bool = True) -> BeamModel:
    table = table_of(free_space) if with_table else CODES
    return BeamModel(free_space, table, CONFIG.beam_model, CONFIG.squash)
