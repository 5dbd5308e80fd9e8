"""Compiling what a live localizer needs before the first scan comes; it loads nothing of the mapper."""

import numpy as np

from localization.config import LocalizationConfig
from localization.localizer import Localizer
from maps.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from maps.odometry import Odometry
from maps.ray_casting import cast_rays
from maps.scan import Scan
from maps.se2 import IDENTITY

_STEPS, _SCATTER_AT = 20, 10
_PERIOD = 25_000_000
"""Nanoseconds."""


def warm_up_localizer(config: LocalizationConfig) -> None:
    """Compile the kernels, or load them from numba's cache: track a car through a room, and search for it."""
    cells = np.full((160, 240), OCCUPIED, dtype=np.int8)
    cells[1:-1, 1:-1] = FREE
    cells[60:90, 150:180] = OCCUPIED
    room = OccupancyGrid(cells, 0.05, IDENTITY)
    bearings = np.linspace(-2.3, 2.3, 1081)
    localizer = Localizer(room, config, np.random.default_rng(0))
    localizer.set_pose(np.array([2.0, 3.0, 0.0]))
    for step in range(_STEPS):
        stamp, moved = step * _PERIOD, np.array([0.05 * step, 0.0, 0.0])
        if step == _SCATTER_AT:
            localizer.scatter()
        localizer.add_odometry(Odometry(stamp, moved, np.array([2.0, 0.0, 0.0])))
        ranges = cast_rays(room, np.array([2.0, 3.0, 0.0]) + moved, bearings, 30.0)
        localizer.add_scan(Scan(stamp, bearings, ranges, np.linspace(0.0, 0.02, 1081), IDENTITY, 30.0))
        localizer.pose_at(stamp)
