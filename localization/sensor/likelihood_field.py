"""The likelihood field: how near the end points of a scan lie to walls.

Thrun, Burgard and Fox: Probabilistic Robotics (2005), section 6.4. An end point is on the nearest wall, to
within a deviation, or on something that the map does not know, as people and moved furniture are; so no
point, and no share of the points, rules a place out alone. It needs one look at the map for each point,
whatever lies between, and varies smoothly with the pose: on a smooth track its error is a third of that of
the beam model, which compares ranges and is as sure of steps of cells as of corners.
"""

from functools import lru_cache
from math import ceil, sqrt

import numpy as np
from numpy.typing import NDArray

from racecar.localization.floor.free_space import FreeSpace
from racecar.localization.floor.walls import Walls
from racecar.localization.sensor.beams import Beams
from racecar.localization.sensor.distance_codes import CODES, STEP, DistanceCodes
from racecar.localization.sensor.likelihood_field_kernels import add_up_points, grid_poses, mean_of_codes
from racecar.maps.geometry.se2 import Pose

FINEST = 0.025
"""Metres: pixels of the field are as wide at most, interpolated between the centres of cells. Measured: with
the cells of 5 cm themselves, errors on exact maps are 1.2 to 1.6 times as large."""
_MOST_PIXELS = 1e8
"""Bytes; on a larger map they are wider. By judgement: a fifth of what the process takes anyway."""
DEVIATION = 0.05
"""Metres of standard deviation of an end point from its wall: a cell of a usual map. Measured on foreign
drives, races and recordings: with 0.1 moved furniture draws the cloud aside, with 0.03 cars that slip are
lost more often."""
UNMAPPED = 0.1
"""Likelihood of an end point on something that the map does not know, where that on a wall is 1. By
judgement; 0.2 changes no error by more than its scatter."""
DEPENDENCE = 2.5
"""Points that count as one, since those side by side lie on one wall and err alike. Measured likewise: with 4
cars that slip at 8 m/s are lost more often, with 1 the cloud is too narrow."""
_FIT_DEVIATION = 0.15
"""Metres within which a point counts as on a wall where only that is asked: by judgement three deviations, as
the pose may be off, too."""

_FITS = np.exp(-0.5 * (np.arange(CODES) * STEP / _FIT_DEVIATION) ** 2).astype(np.float32)
"""(256,) how much a point is on a wall, by the code of its distance: the Gaussian, by definition."""


class LikelihoodField:
    """The field of a map, and where on it the car can be."""

    def __init__(self, walls: Walls, free_space: FreeSpace) -> None:
        most = max(1, int(sqrt(_MOST_PIXELS / walls.distances.size)))
        self._per_cell = min(ceil(walls.grid.resolution / FINEST), most)
        self.distances = DistanceCodes(walls, walls.grid.resolution / self._per_cell)
        self._is_standable = free_space.is_standable

    def log_likelihood(self, map_from_base: Pose, beams: Beams, surface: float) -> NDArray[np.float64]:
        """(N,) log-likelihood of a scan from each of the poses (N, 3), its points not taken as independent.

        The surface of walls is so many metres before the centres of their cells. A pose where the car cannot
        stand gets what a scan would of which no point is on a wall.
        """
        return add_up_points(
            grid_poses(map_from_base, self.distances.raster_in_map),
            self._in_pixels(beams),
            beams.base_from_laser[:2] / self.distances.pixel,
            self.distances.codes,
            self._is_standable,
            self._per_cell,
            log_table(DEVIATION, surface),
        )

    def fits(self, map_from_base: Pose, beams: Beams, surface: float) -> NDArray[np.float64]:
        """(M,) how much each end point is on a wall, 0 to 1, on average over poses (N, 3)."""
        poses = grid_poses(map_from_base, self.distances.raster_in_map)
        return mean_of_codes(poses, self._in_pixels(beams), self.distances.codes, _fit_table(surface))

    def _in_pixels(self, beams: Beams) -> NDArray[np.float32]:
        return beams.points_in_base.astype(np.float32) / np.float32(self.distances.pixel)


@lru_cache(maxsize=64)
def log_table(deviation: float, surface: float) -> NDArray[np.float32]:
    """(256,) what an end point adds to the log-likelihood, by the code of its distance."""
    likelihood = (1.0 - UNMAPPED) * _on_wall(deviation, surface) + UNMAPPED
    likelihood[-1] = UNMAPPED
    return np.asarray(np.log(likelihood) / DEPENDENCE, dtype=np.float32)


@lru_cache(maxsize=64)
def _fit_table(surface: float) -> NDArray[np.float32]:
    return _on_wall(_FIT_DEVIATION, surface).astype(np.float32)


def _on_wall(deviation: float, surface: float) -> NDArray[np.float64]:
    """(256,) how much a point is on a wall, whose surface is so many metres before the centre of its cell."""
    distances = np.maximum(np.arange(CODES) * STEP - surface, 0.0)
    return np.asarray(np.exp(-0.5 * (distances / deviation) ** 2))
