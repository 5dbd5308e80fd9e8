"""The centre line of a race track and the track's width on both sides."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter1d, label, minimum_filter1d
from scipy.spatial import cKDTree
from shapely import STRtree, linestrings
from skimage.draw import polygon2mask
from skimage.measure import find_contours

from racecar.maps.grid.lap import inside_of
from racecar.maps.grid.occupancy_grid import (
    FREE,
    FREE_THRESHOLD,
    OCCUPIED,
    OCCUPIED_FROM,
    UNKNOWN,
    OccupancyGrid,
)
from racecar.maps.grid.ray_casting import cast_rays

_FINE = 5
"""Width measurements per point of the line, since a thin post may stand between two points."""
_FARTHEST = 100.0
"""Longest width in metres that is searched for, since no lane is wider."""
_SMALLEST_OBSTACLE = 0.02
"""Square metres of unseen floor that bound a track, chosen by judgement; less is a gap between beams."""
_WALL_RADIUS = 0.08
"""Metres around the start of a wall's cells within which its returns are averaged. Chosen by judgement: more
than lasers err, less than the distance to the next object. Measured on the shipped track: without it, 2 cm
cells make widths 2.7 cm too small."""


@dataclass(frozen=True, eq=False)
class CentreLine:
    """A closed line in the direction of driving; the last point connects to the first."""

    points: NDArray[np.float64]
    """(N, 2) metres in the map."""
    right: NDArray[np.float64]
    """(N,) metres to the right-hand boundary, along the normal."""
    left: NDArray[np.float64]
    """(N,) metres to the left-hand boundary, along the normal."""

    @property
    def length(self) -> float:
        """Length of the closed line in metres."""
        return float(np.sum(np.hypot(*(np.roll(self.points, -1, axis=0) - self.points).T)))

    @property
    def normals(self) -> NDArray[np.float64]:
        """(N, 2) unit vectors to the left."""
        return _normals(self.points)

    @property
    def crossed(self) -> NDArray[np.int64]:
        """(M,) indices of points whose normals, as long as the track is wide, cross those of later points."""
        right = self.points - self.right[:, None] * self.normals
        left = self.points + self.left[:, None] * self.normals
        across = linestrings(np.stack([right, left], axis=1))
        first, second = STRtree(across).query(across, predicate="crosses")
        return np.unique(first[first < second])


def centre_line(
    grid: OccupancyGrid,
    lap: NDArray[np.float64],
    returns: NDArray[np.floating[Any]],
    *,
    spacing: float,
    smoothing: float,
) -> CentreLine | None:
    """The centre line of the track on which a lap (N, 2) was driven: equally far from everything that bounds
    it inside and outside the lap. None where one side has no boundary.

    It is a level line of the difference of both distances, hence closed and free of self-intersections.
    Widths end at the ``returns`` (M, 2), in metres, because occupied cells are as thick as the returns
    scatter. Points are ``spacing`` metres apart and smoothed by a Gaussian of ``smoothing`` metres. At 0.3,
    normals as long as the shipped track is wide cross one another; at 0.5, as measured, none do.
    """
    blocked = _blocked(grid)
    inside = polygon2mask(grid.cells.shape, grid.raster_of(np.array(inside_of(lap).exterior.coords)))
    if not np.any(blocked & inside) or not np.any(blocked & ~inside):
        return None
    farther_in = distance_transform_edt(~(blocked & inside)) - distance_transform_edt(~(blocked & ~inside))
    contours = [line for line in find_contours(farther_in, 0.0) if np.array_equal(line[0], line[-1])]
    if not contours:
        return None
    middle = grid.center_of(max(contours, key=len)[:-1])
    middle = _smoothed(_evenly(middle, grid.resolution), smoothing / grid.resolution)
    middle = _evenly(middle, spacing / _FINE)
    if _area(middle) * _area(lap) < 0.0:
        middle = middle[::-1]
    middle = np.roll(middle, -int(np.argmin(np.hypot(*(middle - lap[0]).T))), axis=0)
    walls = replace(grid, cells=np.where(blocked, OCCUPIED, FREE).astype(np.int8))
    surfaces, normals = cKDTree(returns), _normals(middle)
    left, right = (_widths(walls, surfaces, middle, towards) for towards in (normals, -normals))
    return CentreLine(middle[::_FINE], _narrowest(right), _narrowest(left))


def _blocked(grid: OccupancyGrid) -> NDArray[np.bool_]:
    """(rows, columns) cells a car cannot be on: walls, and unseen areas larger than gaps between beams."""
    is_free = (grid.cells != UNKNOWN) & (grid.cells <= 100 * FREE_THRESHOLD)
    is_wall = grid.cells >= OCCUPIED_FROM
    unseen, _ = label(~is_free & ~is_wall)
    square_metres = np.bincount(unseen.ravel()) * grid.resolution**2
    square_metres[0] = 0.0  # label 0 is everything that was seen
    is_obstacle: NDArray[np.bool_] = square_metres > _SMALLEST_OBSTACLE
    return is_wall | is_obstacle[unseen]


def _evenly(ring: NDArray[np.float64], spacing: float) -> NDArray[np.float64]:
    """Resample a closed line to evenly spaced points (N, 2); N is a multiple of `_FINE`."""
    closed = np.concatenate([ring, ring[:1]])
    along = np.append(0.0, np.cumsum(np.hypot(*np.diff(closed, axis=0).T)))
    count = _FINE * max(2, round(along[-1] / spacing / _FINE))
    at = np.linspace(0.0, along[-1], count, endpoint=False)
    return np.column_stack([np.interp(at, along, axis) for axis in closed.T])


def _smoothed(ring: NDArray[np.float64], points: float) -> NDArray[np.float64]:
    """Smooth a closed line by a Gaussian with a standard deviation of ``points`` points."""
    return ring if points == 0.0 else np.asarray(gaussian_filter1d(ring, points, axis=0, mode="wrap"))


def _area(ring: NDArray[np.float64]) -> float:
    """Signed area in square metres; negative for a clockwise line."""
    (x, y), (next_x, next_y) = ring.T, np.roll(ring, -1, axis=0).T
    return float(np.sum(x * next_y - next_x * y)) / 2.0


def _normals(ring: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 2) unit vectors to the left of a closed line."""
    ahead = np.roll(ring, -1, axis=0) - np.roll(ring, 1, axis=0)
    normals: NDArray[np.float64] = np.column_stack([-ahead[:, 1], ahead[:, 0]]) / np.hypot(*ahead.T)[:, None]
    return normals


def _widths(
    walls: OccupancyGrid,
    surfaces: "cKDTree[None]",
    ring: NDArray[np.float64],
    towards: NDArray[np.float64],
) -> NDArray[np.float64]:
    """(N,) metres from points of a closed line, in directions (N, 2), to the nearest wall. A wall is where
    its returns lie on average, around the start of the first occupied cell."""
    headings = np.arctan2(towards[:, 1], towards[:, 0])
    widths = cast_rays(walls, np.column_stack([ring, headings]), np.zeros(len(ring)), _FARTHEST)
    is_met = np.flatnonzero(np.isfinite(widths))
    ends = ring[is_met] + widths[is_met, None] * towards[is_met]
    for k, end in zip(is_met, ends, strict=True):
        near: list[int] = surfaces.query_ball_point(end, _WALL_RADIUS)
        if near:
            widths[k] += np.median((surfaces.data[near] - end) @ towards[k])
    return widths


def _narrowest(widths: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N / _FINE,) smallest of the widths (N,) around each kept point."""
    return np.asarray(minimum_filter1d(widths, _FINE, mode="wrap"))[::_FINE]
