"""Compile the mapper's kernels, or load them from numba's cache, before the first scan arrives."""

import numpy as np

from racecar.mapping.config import MappingConfig
from racecar.mapping.grid.growing_grid import GrowingGrid
from racecar.mapping.mapper import Mapper
from racecar.maps.geometry.se2 import IDENTITY, Pose
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from racecar.maps.grid.ray_casting import cast_rays
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

_SCANS, _TURN = 120, 0.06
"""Number of scans, and radians along the ring between them: more than a lap, so that a loop closes."""
_PERIOD = 100_000_000
"""Nanoseconds between scans: those of a laser of ten scans a second, since all kernels serve any."""


def warm_up() -> None:
    """Map a simulated lap that closes a loop, so that the first real scan is as fast as later ones."""
    config = MappingConfig()
    mapper = Mapper(config)
    room, bearings = _ring(), np.linspace(-2.3, 2.3, 1081)
    for k in range(_SCANS):
        map_from_base = _place_on_the_ring(k * _TURN)
        mapper.add_odometry(Odometry(k * _PERIOD, map_from_base, IDENTITY))
        ranges = cast_rays(room, map_from_base, bearings, 30.0)
        ranges[-10:] = np.inf  # misses have a kernel of their own
        mapper.add_scan(Scan(k * _PERIOD, bearings, ranges, np.zeros_like(bearings), IDENTITY, 30.0))
    session = mapper.session()
    grid = GrowingGrid(config.resolution, config.rendering)
    grid.draw(session.rays, session.map_from_keyframe)


def _ring() -> OccupancyGrid:
    """A room of 8 × 6 m with a block in the middle and distinct corners."""
    cells = np.full((124, 164), OCCUPIED, dtype=np.int8)
    cells[2:-2, 2:-2] = FREE
    cells[46:78, 50:114] = OCCUPIED
    cells[2:18, 146:162] = OCCUPIED
    cells[110:122, 2:10] = OCCUPIED
    return OccupancyGrid(cells, 0.05, np.array([-0.1, -0.1, 0.0]))


def _place_on_the_ring(angle: float) -> Pose:
    """A pose on the ring around the block, counter-clockwise."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([4.0 + 2.6 * cos, 3.0 + 1.9 * sin, np.arctan2(1.9 * cos, -2.6 * sin)])
