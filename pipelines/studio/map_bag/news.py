"""What a process that maps or checks a bag tells the page meanwhile."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid


@dataclass(frozen=True)
class Progress:
    """How far it is."""

    what: str
    share: float
    """0 to 1."""


@dataclass(frozen=True, eq=False)
class Sketch:
    """The car on the map so far."""

    grid: OccupancyGrid | None
    """None where the map has not been drawn again."""
    map_from_base: Pose
    """(3,)"""
    scan_in_map: NDArray[np.float64]
    """(N, 2)"""
    path: Pose
    """(K, 3) the car at the keyframes."""
    loops: NDArray[np.float64]
    """(L, 2, 2) places (2,) between which loops were closed."""


News = Progress | Sketch
