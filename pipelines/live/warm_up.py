"""Compiling what a live mapper needs before the first scan comes, by a short drive."""

import numpy as np

from mapping.config import MappingConfig
from mapping.growing_grid import GrowingGrid
from mapping.mapper import Mapper
from maps.odometry import Odometry
from maps.ray_casting import cast_rays
from maps.scan import Scan
from maps.se2 import IDENTITY, Pose
from pipelines.warm_up import draw_ring

_SCANS, _TURN = 120, 0.06
"""With so many radians of the way round from one to the next: more than a round."""
_PERIOD = 100_000_000
"""Nanoseconds."""


def warm_up_mapper() -> None:
    """Compile the mapper's kernels, or load them from numba's cache; the drive closes a loop."""
    config = MappingConfig()
    mapper = Mapper(config)
    room, bearings = draw_ring(), np.linspace(-2.3, 2.3, 1081)
    for k in range(_SCANS):
        map_from_base = _place_on_the_ring(k * _TURN)
        mapper.add_odometry(Odometry(k * _PERIOD, map_from_base, IDENTITY))
        ranges = cast_rays(room, map_from_base, bearings, 30.0)
        mapper.add_scan(Scan(k * _PERIOD, bearings, ranges, np.zeros_like(bearings), IDENTITY, 30.0))
    session = mapper.session()
    GrowingGrid(config.resolution).draw(session.rays, session.map_from_keyframe)


def _place_on_the_ring(angle: float) -> Pose:
    """Round the block in the middle of `draw_ring`, counter-clockwise."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([4.0 + 2.6 * cos, 3.0 + 1.9 * sin, np.arctan2(1.9 * cos, -2.6 * sin)])
