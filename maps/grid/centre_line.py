"""The middle of a race track, and how far it is to both sides."""

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
"""Points at which a width is measured for each point of the line, since a thin post may stand between two."""
_FARTHEST = 100.0
"""Metres at which a side is sought, since no lane is wider."""
_SMALLEST_OBSTACLE = 0.02
"""Square metres of unseen floor that bound a track; less is a gap between beams. By judgement."""
_WALL_RADIUS = 0.08
"""Metres about the beginning of a wall's cells in which its returns are looked for. By judgement: more than
lasers err, less than what stands at a wall is away from it. Measured on the shipped track: without it, cells
of 2 cm make widths 2.7 cm too small."""


@dataclass(frozen=True, eq=False)
class CentreLine:
    """A closed line in the direction of driving; its last point is followed by the first one."""

    points: NDArray[np.float64]
    """(N, 2) metres in the map."""
    right: NDArray[np.float64]
    """(N,) metres to what bounds the track, along the normal."""
    left: NDArray[np.float64]
    """(N,) likewise."""

    @property
    def length(self) -> float:
        """Metres, once round."""
        return float(np.sum(np.hypot(*(np.roll(self.points, -1, axis=0) - self.points).T)))

    @property
    def normals(self) -> NDArray[np.float64]:
        """(N, 2) unit vectors to the left."""
        return _normals(self.points)

    @property
    def crossed(self) -> NDArray[np.int64]:
        """(M,) the points whose normals, as long as the track is wide, cross those of later points."""
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
    """The middle of the track on which a lap (N, 2) was driven: as far from all that bounds it inside the lap
    as from all outside. None where nothing bounds it on one of the sides.

    It is a level line of the difference of both distances, so that it is closed and does not cross itself.
    Widths end where the ``returns`` (M, 2) lie, in metres, as occupied cells are as thick as these scatter.
    Points are ``spacing`` metres apart, and smoothed over ``smoothing`` metres, a standard deviation; with
    0.3 normals as long as the shipped track is wide cross one another, with 0.5, as measured, none.
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
    """(rows, columns) what no car can be on: walls, and what nobody saw but for gaps between beams."""
    is_free = (grid.cells != UNKNOWN) & (grid.cells <= 100 * FREE_THRESHOLD)
    is_wall = grid.cells >= OCCUPIED_FROM
    unseen, _ = label(~is_free & ~is_wall)
    square_metres = np.bincount(unseen.ravel()) * grid.resolution**2
    square_metres[0] = 0.0  # all that is no unseen cell
    is_obstacle: NDArray[np.bool_] = square_metres > _SMALLEST_OBSTACLE
    return is_wall | is_obstacle[unseen]


def _evenly(ring: NDArray[np.float64], spacing: float) -> NDArray[np.float64]:
    """(N, 2) points on a closed line, evenly and about that far apart; a whole number of `_FINE` of them."""
    closed = np.concatenate([ring, ring[:1]])
    along = np.append(0.0, np.cumsum(np.hypot(*np.diff(closed, axis=0).T)))
    count = _FINE * max(2, round(along[-1] / spacing / _FINE))
    at = np.linspace(0.0, along[-1], count, endpoint=False)
    return np.column_stack([np.interp(at, along, axis) for axis in closed.T])


def _smoothed(ring: NDArray[np.float64], points: float) -> NDArray[np.float64]:
    """A closed line smoothed over so many of its points."""
    return ring if points == 0.0 else np.asarray(gaussian_filter1d(ring, points, axis=0, mode="wrap"))


def _area(ring: NDArray[np.float64]) -> float:
    """Square metres inside a closed line; negative where it goes round clockwise."""
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
    """(N,) metres from points of a closed line, in directions (N, 2), to the nearest wall: to the middle of
    the returns about the place where the first occupied cell begins."""
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
    """(N / _FINE,) the least of the widths (N,) about each point that is kept."""
    return np.asarray(minimum_filter1d(widths, _FINE, mode="wrap"))[::_FINE]
