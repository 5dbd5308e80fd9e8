"""Likelihood field: how close the end points of a scan are to walls.

Thrun, Burgard and Fox: Probabilistic Robotics (2005), section 6.4. An end point is on the nearest wall, with
some deviation, or on an unmapped object such as people and moved furniture; so no single point, and no share
of them, rules a pose out. It takes one look-up per point and is smooth in the pose. On a smooth track its
error is a third of that of the beam model, which compares ranges and trusts stair steps of cells as much as
corners.
"""

import math
from functools import lru_cache
from math import ceil, hypot, sqrt

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import affine_transform

from racecar.localization.floor.free_space import FreeSpace
from racecar.localization.floor.patches import strips
from racecar.localization.floor.walls import Walls
from racecar.localization.sensor.end_points import EndPoints
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


@njit(cache=True, nogil=True)
def grid_poses(map_from_base: Pose, grid_in_map: NDArray[np.float64]) -> NDArray[np.float32]:
    """(N, 4) column, row, cosine and sine of poses (N, 3) on the grid, in cells from its corner.

    ``grid_in_map`` is x, y, cos and sin of the grid's origin and cells per metre.
    """
    x0, y0, cos0, sin0, per_metre = grid_in_map
    on_grid = np.empty((len(map_from_base), 4), dtype=np.float32)
    for i in range(len(map_from_base)):
        x, y = map_from_base[i, 0] - x0, map_from_base[i, 1] - y0
        cos, sin = math.cos(map_from_base[i, 2]), math.sin(map_from_base[i, 2])
        on_grid[i, 0] = (cos0 * x + sin0 * y) * per_metre
        on_grid[i, 1] = (cos0 * y - sin0 * x) * per_metre
        on_grid[i, 2] = cos * cos0 + sin * sin0
        on_grid[i, 3] = sin * cos0 - cos * sin0
    return on_grid


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
def add_up_points(
    grid_from_base: NDArray[np.float32],
    points: NDArray[np.float32],
    laser: NDArray[np.float64],
    codes: NDArray[np.uint8],
    is_standable: NDArray[np.bool_],
    per_cell: int,
    log_by_code: NDArray[np.float32],
) -> NDArray[np.float64]:
    """(N,) sum of the log-likelihoods of points (P, 2) at poses on the field (N, 4), see `grid_poses`.

    Points and the laser (2,) are in pixels relative to the base. ``codes`` have a margin of one pixel for
    outside the map. Where the laser cannot be by ``is_standable``, whose cells are ``per_cell`` pixels wide,
    no point counts as on a wall.
    """
    rows, columns = codes.shape
    flat, count = codes.ravel(), len(points)
    x, y = points[:, 0].copy(), points[:, 1].copy()
    places = np.empty(count, dtype=np.int32)
    totals = np.empty(len(grid_from_base))
    outside = count * log_by_code[-2]
    last_column, last_row = np.float32(columns - 1), np.float32(rows - 1)
    for i in range(len(grid_from_base)):
        column, row, cos, sin = grid_from_base[i]
        laser_column = math.floor(column + cos * laser[0] - sin * laser[1])
        laser_row = math.floor(row + sin * laser[0] + cos * laser[1])
        is_on_map = 0 <= laser_row < rows - 2 and 0 <= laser_column < columns - 2
        if not is_on_map or not is_standable[laser_row // per_cell, laser_column // per_cell]:
            totals[i] = outside
            continue
        left, low = column + np.float32(1.0), row + np.float32(1.0)
        for k in range(count):
            c = min(max(left + cos * x[k] - sin * y[k], np.float32(0.0)), last_column)
            r = min(max(low + sin * x[k] + cos * y[k], np.float32(0.0)), last_row)
            places[k] = np.int32(r) * np.int32(columns) + np.int32(c)
        total = np.float32(0.0)
        for k in range(count):
            total += log_by_code[flat[places[k]]]
        totals[i] = total
    return totals


@njit(cache=True, nogil=True)
def mean_of_codes(
    grid_from_base: NDArray[np.float32],
    points: NDArray[np.float32],
    codes: NDArray[np.uint8],
    value_by_code: NDArray[np.float32],
) -> NDArray[np.float64]:
    """(P,) mean value of the codes of points (P, 2) over poses on the field (N, 4).

    NaN values are skipped; the mean is NaN for points with no other value. At poses off the map, the value is
    zero.
    """
    last_row, last_column = codes.shape[0] - 1, codes.shape[1] - 1
    sums, counts = np.zeros(len(points)), np.zeros(len(points))
    for i in range(len(grid_from_base)):
        column, row, cos, sin = grid_from_base[i]
        is_on_map = 0 <= row < last_row - 1 and 0 <= column < last_column - 1
        for k in range(len(points)):
            c = math.floor(column + cos * points[k, 0] - sin * points[k, 1]) + 1
            r = math.floor(row + sin * points[k, 0] + cos * points[k, 1]) + 1
            value = value_by_code[codes[min(max(r, 0), last_row), min(max(c, 0), last_column)]]
            says_nothing = math.isnan(value)
            sums[k] += 0.0 if says_nothing else value
            counts[k] += not (says_nothing and is_on_map)
    return np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)
