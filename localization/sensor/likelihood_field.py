"""Likelihood field: how close the end points of a scan are to walls.

Thrun, Burgard and Fox: Probabilistic Robotics (2005), section 6.4. An end point is on the nearest wall, with
some deviation, or on an unmapped object such as people and moved furniture; so no single point, and no share
of them, rules a pose out. It takes one look-up per point and is smooth in the pose. On a smooth track its
error is a third of that of the beam model, which compares ranges and trusts stair steps of cells as much as
corners.
"""

from functools import lru_cache
from math import ceil, hypot, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import affine_transform

from racecar.localization.floor.free_space import FreeSpace
from racecar.localization.floor.patches import strips
from racecar.localization.floor.walls import Walls
from racecar.localization.sensor.end_points import EndPoints
from racecar.localization.sensor.likelihood_field_kernels import add_up_points, grid_poses, mean_of_codes
from racecar.maps.geometry.se2 import Pose

STEP = 0.01
"""Metres per code. Chosen by judgement: far below a cell, and 254 of them exceed any deviation."""
CODES = 256
"""Values of a byte, by definition; the last is for outside the map, the one before for all larger
distances."""
FINEST = 0.025
"""Largest pixel in metres, interpolated between the centres of cells. Measured: with the cells of 5 cm
themselves, errors on exact maps are 1.2 to 1.6 times as large."""
_MOST_PIXELS = 1e8
"""Bytes; pixels of a larger map are wider. Chosen by judgement: a fifth of what the process takes anyway."""
DEVIATION = 0.04
"""Standard deviation in metres of an end point from its wall: most of a cell of a usual map. Measured on
foreign drives, races and recordings: with 0.05 cars without odometry were metres off for seconds along bends,
with 0.03 a narrow cloud that stands 0.2 m aside does not come back."""
UNMAPPED = 0.1
"""Likelihood of an end point on an unmapped object, relative to 1 on a wall. Chosen by judgement; 0.2 changes
no error by more than its scatter."""
BEYOND = 0.6
"""Likelihood of an end point beyond an edge of the map that cuts off floor where a car can be: about the mean
at the right place, so that it is no evidence either way. Measured on maps cropped inside the outer wall: with
0.1, as for what is not on a wall, cars that drove past were taken to be up to 40 m away, with 0.35 one still
was."""
DEPENDENCE = 2.5
"""Points per independent observation, since adjacent ones lie on one wall and have correlated errors.
Measured likewise: with 4 cars that slip at 8 m/s are lost more often, with 1 the cloud is too narrow."""
_FIT_DEVIATION = 0.12
"""Metres within which a point is on a wall, where only that matters. Measured: with 0.15 moved furniture
draws the cloud aside as often, and cars without odometry err nearly twice as far."""


class LikelihoodField:
    """The likelihood field and free space of a map."""

    def __init__(self, walls: Walls, free_space: FreeSpace) -> None:
        most = max(1, int(sqrt(_MOST_PIXELS / walls.distances.size)))
        self._per_cell = min(ceil(walls.grid.resolution / FINEST), most)
        self.pixel = walls.grid.resolution / self._per_cell
        """Pixel size in metres."""
        self.codes = distance_codes(walls, free_space, self.pixel)
        self._is_standable = free_space.is_standable
        x, y, yaw = walls.grid.map_from_grid
        self._raster_in_map = np.array([x, y, np.cos(yaw), np.sin(yaw), 1.0 / self.pixel])

    def log_likelihood(self, map_from_base: Pose, points: EndPoints, surface: float) -> NDArray[np.float64]:
        """(N,) log-likelihood of a scan at poses (N, 3), with dependent points.

        The surface of walls is ``surface`` metres before the centres of their cells. At poses where the car
        cannot stand, no point counts as on a wall.
        """
        return add_up_points(
            grid_poses(map_from_base, self._raster_in_map),
            self._in_pixels(points),
            points.laser / self.pixel,
            self.codes,
            self._is_standable,
            self._per_cell,
            log_table(DEVIATION, surface),
        )

    def fits(
        self, map_from_base: Pose, points: EndPoints, surface: float, tolerance: float = 0.0
    ) -> NDArray[np.float64]:
        """(M,) fit of each end point, 0 to 1, averaged over poses (N, 3).

        The poses have a ``tolerance`` in metres. NaN where a point is off the map.
        """
        poses = grid_poses(map_from_base, self._raster_in_map)
        within = round(hypot(_FIT_DEVIATION, tolerance), 2)  # so that there are few tables
        return mean_of_codes(poses, self._in_pixels(points), self.codes, _fit_table(within, surface))

    def _in_pixels(self, points: EndPoints) -> NDArray[np.float32]:
        return points.in_base.astype(np.float32) / np.float32(self.pixel)


def distance_codes(walls: Walls, free_space: FreeSpace, pixel: float) -> NDArray[np.uint8]:
    """(rows + 2, columns + 2) quantized distances from pixel centres to walls; ``pixel`` is in metres.

    Interpolated between cell centres, where cells may be larger or smaller. The margin is for what is
    outside: unknown where the floor continues there.
    """
    cells = pixel / walls.grid.resolution
    rows, columns = np.maximum(np.rint(np.array(walls.distances.shape) / cells), 1).astype(np.int64).tolist()
    codes = np.full((rows + 2, columns + 2), CODES - 2, dtype=np.uint8)
    for strip in strips((rows, columns)):
        first, shape = np.array([strip.start, 0]), (strip.stop - strip.start, columns)
        corner = (first + 0.5) * cells - 0.5
        metres = affine_transform(walls.distances, [cells, cells], corner, shape, order=1, mode="nearest")
        steps = np.clip(np.rint(metres / np.float32(STEP)), 0, CODES - 2)
        codes[strip.start + 1 : strip.stop + 1, 1:-1] = steps
    for margins, is_open in ((codes, free_space.is_open), (codes.T, free_space.is_open.T)):
        at = ((np.arange(margins.shape[1] - 2) + 0.5) * cells).astype(np.int64)
        for edge in (0, -1):
            margins[edge, 1:-1][np.take(is_open[edge], at, mode="clip")] = CODES - 1
    return codes


@lru_cache(maxsize=64)
def log_table(deviation: float, surface: float) -> NDArray[np.float32]:
    """(256,) log-likelihood of an end point by its distance code."""
    likelihood = (1.0 - UNMAPPED) * _on_wall(deviation, surface) + UNMAPPED
    likelihood[-2:] = UNMAPPED, BEYOND
    return np.asarray(np.log(likelihood) / DEPENDENCE, dtype=np.float32)


@lru_cache(maxsize=256)
def _fit_table(deviation: float, surface: float) -> NDArray[np.float32]:
    table = _on_wall(deviation, surface).astype(np.float32)
    table[-1] = np.nan
    return table


def _on_wall(deviation: float, surface: float) -> NDArray[np.float64]:
    """(256,) fit of a point to a wall whose surface is ``surface`` metres before the centre of its cell."""
    distances = np.arange(CODES) * STEP - surface
    return np.asarray(np.exp(-0.5 * (distances / deviation) ** 2))
