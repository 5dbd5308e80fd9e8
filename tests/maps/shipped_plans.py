"""The shipped maps, one object for all tests of a process: what is planned for a simulation in it is kept."""

from functools import cache

from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.maps.shipped import shipped_map


@cache
def shipped_plan(name: str) -> OccupancyGrid:
    return load_map(shipped_map(name))
