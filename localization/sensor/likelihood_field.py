"""The likelihood field: how near the end points of a scan lie to walls.

Thrun, Burgard and Fox: Probabilistic Robotics (2005), section 6.4. An end point is on the nearest wall, to
within a deviation, or on something that the map does not know, as people and moved furniture are; so no
point, and no share of the points, rules a place out alone. It needs one look at the map for each point,
whatever lies between, and varies smoothly with the pose: on a smooth track its error is a third of that of
the beam model, which compares ranges and is as sure of steps of cells as of corners.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from racecar.localization.floor.free_space import FreeSpace
from racecar.localization.floor.patches import strips
from racecar.localization.floor.walls import Walls
from racecar.localization.sensor.beams import Beams
from racecar.localization.sensor.likelihood_field_kernels import add_up_points, grid_poses
from racecar.maps.geometry.se2 import Pose, transform_points

STEP = 0.01
"""Metres between two codes of distances: far below a cell, and 255 of them reach farther than any deviation."""
_CODES = 256
"""By definition of a byte; the last one is for all that is farther, and beyond the map."""
DEVIATION = 0.1
"""Metres of standard deviation of an end point from its wall. Measured on foreign drives, races and
recordings: with 0.15 the errors on tracks are 1.2 times as large, with 0.07 cars that slip are lost more
often."""
UNMAPPED = 0.1
"""Likelihood of an end point on something that the map does not know, where that on a wall is 1. By
judgement; 0.2 changes no error by more than its scatter."""
DEPENDENCE = 2.5
"""Points that count as one, since those side by side lie on one wall and err alike. Measured likewise: with 4
cars that slip at 8 m/s are lost more often, with 1 the cloud is too narrow."""

_FITS = np.exp(-0.5 * (np.arange(_CODES) * STEP / 0.15) ** 2)
"""(256,) how much a point is on a wall, by the code of its distance; by judgement one and a half deviations,
as the pose may be off, too."""


class LikelihoodField:
    """The field of a map, and where on it the car can be."""

    def __init__(self, walls: Walls, free_space: FreeSpace) -> None:
        self.grid = walls.grid
        self.codes = _coded(walls.distances)
        """(rows + 2, columns + 2) distances to the nearest wall in steps, with a margin beyond the map."""
        self._is_standable = free_space.is_standable
        self._grid_in_map = free_space.grid_in_map

    def log_likelihood(self, map_from_base: Pose, beams: Beams) -> NDArray[np.float64]:
        """(N,) log-likelihood of a scan from each of the poses (N, 3), its points not taken as independent.

        A pose where the car cannot stand gets what a scan would of which no point is on a wall.
        """
        points = beams.points_in_base.astype(np.float32) / np.float32(self.grid.resolution)
        laser = beams.base_from_laser
        return add_up_points(
            grid_poses(map_from_base, self._grid_in_map),
            points,
            np.array([laser[0], laser[1]]) / self.grid.resolution,
            self.codes,
            self._is_standable,
            log_table(DEVIATION),
        )

    def fit(self, map_from_base: Pose, beams: Beams) -> float | None:
        """How well a scan fits the map from a pose (3,): the share of its points that are on walls, 0 to 1.

        None where it has no points.
        """
        points = beams.points_in_base
        if len(points) == 0:
            return None
        cells = self.grid.cell_of(transform_points(map_from_base, points)) + 1  # for the margin
        cells = np.clip(cells, 0, np.array(self.codes.shape) - 1)
        return float(_FITS[self.codes[cells[:, 0], cells[:, 1]]].mean())


@lru_cache(maxsize=4)
def log_table(deviation: float) -> NDArray[np.float32]:
    """(256,) what an end point adds to the log-likelihood, by the code of its distance."""
    distances = np.arange(_CODES) * STEP
    likelihood = (1.0 - UNMAPPED) * np.exp(-0.5 * (distances / deviation) ** 2) + UNMAPPED
    likelihood[-1] = UNMAPPED
    return np.asarray(np.log(likelihood) / DEPENDENCE, dtype=np.float32)


def _coded(distances: NDArray[np.float32]) -> NDArray[np.uint8]:
    codes = np.full((distances.shape[0] + 2, distances.shape[1] + 2), _CODES - 1, dtype=np.uint8)
    for rows in strips(distances.shape):
        steps = np.minimum(np.rint(distances[rows] / np.float32(STEP)), _CODES - 1)
        codes[rows.start + 1 : rows.stop + 1, 1:-1] = steps
    return codes
