"""Compiling everything before the first scan."""

import numpy as np

from localization.config import LocalizationConfig
from localization.localizer import Localizer
from maps.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from maps.odometry import Odometry
from maps.scan import Scan
from maps.se2 import IDENTITY


def warm_up() -> None:
    """Compile the kernels, or load them from numba's cache, so that the first scan is as fast as the rest."""
    cells = np.full((30, 30), OCCUPIED, dtype=np.int8)
    cells[1:-1, 1:-1] = FREE
    grid = OccupancyGrid(cells, 0.1, IDENTITY)
    config = LocalizationConfig(particles=10, scattered_particles=10)
    localizer = Localizer(grid, config, np.random.default_rng(0))
    localizer.set_pose(np.array([1.5, 1.5, 0.0]))
    bearings = np.array([-0.5, 0.5])
    for stamp, x in ((0, 0.0), (10**8, 0.1)):
        localizer.add_odometry(Odometry(stamp, np.array([x, 0.0, 0.0]), IDENTITY))
        localizer.add_scan(Scan(stamp, bearings, np.ones(2), np.zeros(2), IDENTITY, 10.0))
