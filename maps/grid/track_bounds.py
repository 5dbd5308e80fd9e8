"""What bounds a race track beside its line: walls, and where there are none, the edge of what was seen."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label, maximum_filter1d, minimum_filter1d
from scipy.spatial import cKDTree
from shapely import STRtree, linestrings

from racecar.maps.errors import UserError
from racecar.maps.geometry.closed_line import ring_normals
from racecar.maps.grid.occupancy_grid import (
    FREE,
    FREE_THRESHOLD,
    OCCUPIED,
    OCCUPIED_FROM,
    UNKNOWN,
    OccupancyGrid,
)
from racecar.maps.grid.ray_casting import cast_rays

_FARTHEST = 100.0
"""Longest width in metres that is searched for, since no lane is wider."""
_SMALLEST_OBSTACLE = 0.02
"""Square metres of unseen floor that bound a track, chosen by judgement; less is a gap between beams."""
_WALL_RADIUS = 0.08
"""Metres around the start of a wall's cells within which its returns are averaged. Chosen by judgement: more
than lasers err, less than the distance to the next object. Measured on the shipped track: without it, 2 cm
cells make widths 2.7 cm too small."""
_GAP = 0.3
"""Metres between obstacles through which no width is measured if it is deeper than that, since a small car is
as wide; the returns of dark and distant walls can be 0.25 m apart."""
_NEARER = 0.7
"""Part of the distance from one point of a line at which another one is much nearer. Chosen by judgement:
about the end of an island all points are nearly as far from it."""
_MOST_OPEN = 0.5
"""Share of a side along which a track may have no wall. Chosen by judgement: where most has none, as in a
hall, the middle has nothing to do with a track."""


@dataclass(frozen=True, eq=False)
class Bound:
    """One side of a track, at N points of its line."""

    widths: NDArray[np.float64]
    """(N,) metres to it along the normal."""
    is_wall: NDArray[np.bool_]
    """(N,) whether there is a wall. Where not, it is the edge of what was seen, or goes straight from wall to
    wall, as where the track crosses itself."""
    is_met: NDArray[np.bool_]
    """(N,) whether the normal meets an obstacle before it leaves the lane; if not, the width is interpolated
    between those beside it."""


class TrackBounds:
    """Measures from lines on a map to what bounds them."""

    def __init__(self, grid: OccupancyGrid, returns: NDArray[np.floating[Any]]) -> None:
        """Widths end at the ``returns`` (M, 2), in metres, because occupied cells are as thick as the returns
        scatter."""
        is_wall = grid.cells >= OCCUPIED_FROM
        self.blocked = is_wall | _unseen(grid)
        """(rows, columns) cells a car cannot be on: walls, and large unseen areas."""
        self._obstacles = replace(grid, cells=np.where(self.blocked, OCCUPIED, FREE).astype(np.int8))
        self._walls = cKDTree(grid.center_of(np.argwhere(is_wall)))
        self._returns = cKDTree(returns)

    def beside(self, fine_ring: NDArray[np.float64], every: int = 1) -> tuple[Bound, Bound]:
        """The left and the right bound of each ``every``-th point of a closed line (N, 2), at the narrowest
        place among the points about it. Raises UserError when most of a side has no wall."""
        normals = ring_normals(fine_ring)
        fine = (self._reached(fine_ring, towards) for towards in (normals, -normals))
        left, right = (minimum_filter1d(widths, every, mode="wrap")[::every] for widths in fine)
        ring, normals = fine_ring[::every], normals[::every]
        leave_left, leave_right = _leave(ring, left, right)
        left[leave_left], right[leave_right] = np.inf, np.inf
        return self._bound(ring, left, normals, "left"), self._bound(ring, right, -normals, "right")

    def _reached(self, ring: NDArray[np.float64], towards: NDArray[np.float64]) -> NDArray[np.float64]:
        """(N,) metres from points (N, 2), in directions (N, 2), to the nearest obstacle, through no gap of up
        to `_GAP`; inf where there is none. A wall is where its returns lie on average, around the start of
        the first occupied cell."""
        beside = _GAP * np.column_stack([-towards[:, 1], towards[:, 0]])
        shares = np.linspace(-1.0, 1.0, 1 + 2 * round(_GAP / self._obstacles.resolution))
        parallel = np.stack([self._rays(ring + share * beside, towards) for share in shares])
        middle = len(shares) // 2
        beside_gap = np.maximum(parallel[: middle + 1].min(axis=0), parallel[middle:].min(axis=0))
        widths: NDArray[np.float64] = parallel[middle]
        widths = np.where(widths > beside_gap + _GAP, beside_gap, widths)
        for k in np.flatnonzero(np.isfinite(widths)):
            end = ring[k] + widths[k] * towards[k]
            near: list[int] = self._returns.query_ball_point(end, _WALL_RADIUS)
            if near:
                widths[k] += np.median((self._returns.data[near] - end) @ towards[k])
        return widths

    def _rays(self, starts: NDArray[np.float64], towards: NDArray[np.float64]) -> NDArray[np.float64]:
        headings = np.arctan2(towards[:, 1], towards[:, 0])
        return cast_rays(
            self._obstacles, np.column_stack([starts, headings]), np.zeros(len(starts)), _FARTHEST
        )

    def _bound(
        self, ring: NDArray[np.float64], widths: NDArray[np.float64], towards: NDArray[np.float64], side: str
    ) -> Bound:
        """The bound at widths (N,) of a closed line; where they are infinite, they are interpolated."""
        is_met = np.isfinite(widths)
        is_wall = np.zeros(len(ring), dtype=np.bool_)
        if np.any(is_met):
            known = np.flatnonzero(is_met)
            widths = np.interp(np.arange(len(ring)), known, widths[known], period=len(ring))
            is_wall = np.asarray(self._walls.query(ring + widths[:, None] * towards)[0] <= _GAP)
        if (share := np.mean(~is_wall)) > _MOST_OPEN:
            raise UserError(
                f"Along {share:.0%} of the lap no wall bounds the track on its {side}; draw walls there in "
                "edits.yaml."
            )
        return Bound(widths, is_wall, is_met)


@dataclass(frozen=True, eq=False)
class CrossingNormals:
    """M pairs of points of a closed line whose normals cross each other."""

    here: NDArray[np.int64]
    """(M,) first point of each pair; each pair is there twice, the other way round, too."""
    there: NDArray[np.int64]
    """(M,) second point of each pair."""
    from_here: NDArray[np.float64]
    """(M,) metres to the left from the first point to where they cross."""
    from_there: NDArray[np.float64]
    """(M,) metres to the left from the second point to where they cross."""


def crossing_normals(
    ring: NDArray[np.float64], left: NDArray[np.float64], right: NDArray[np.float64]
) -> CrossingNormals:
    """Which normals of a closed line (N, 2) cross each other, with their lengths (N,) in metres to the left
    and to the right."""
    normals = ring_normals(ring)
    across = linestrings(np.stack([ring - right[:, None] * normals, ring + left[:, None] * normals], axis=1))
    here, there = STRtree(across).query(across)
    (x, y), (u, v), (r, s) = (ring[there] - ring[here]).T, normals[here].T, normals[there].T
    with np.errstate(divide="ignore", invalid="ignore"):  # of parallel normals, which do not cross
        from_here, from_there = (x * s - y * r) / (u * s - v * r), (x * v - y * u) / (u * s - v * r)
    cross = (-right[here] < from_here) & (from_here < left[here])
    cross &= (-right[there] < from_there) & (from_there < left[there])
    return CrossingNormals(here[cross], there[cross], from_here[cross], from_there[cross])


def _leave(
    ring: NDArray[np.float64], left: NDArray[np.float64], right: NDArray[np.float64]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(N,) points of a closed line whose normals, to the left and right, leave the lane: they come to where
    another point of the line is much nearer; and the points beside these, since past a corner a normal first
    meets the wall behind it."""
    crossing = crossing_normals(ring, np.minimum(left, _FARTHEST), np.minimum(right, _FARTHEST))
    is_nearer = np.abs(crossing.from_there) < _NEARER * np.abs(crossing.from_here)
    leave = np.zeros((2, len(ring)), dtype=np.bool_)
    leave[0, crossing.here[is_nearer & (crossing.from_here > 0.0)]] = True
    leave[1, crossing.here[is_nearer & (crossing.from_here < 0.0)]] = True
    to_left, to_right = maximum_filter1d(leave, 3, axis=1, mode="wrap")
    return to_left, to_right


def _unseen(grid: OccupancyGrid) -> NDArray[np.bool_]:
    """(rows, columns) cells of unseen areas larger than gaps between beams."""
    is_seen = (grid.cells != UNKNOWN) & (grid.cells <= 100 * FREE_THRESHOLD) | (grid.cells >= OCCUPIED_FROM)
    areas, _ = label(~is_seen)
    square_metres = np.bincount(areas.ravel()) * grid.resolution**2
    square_metres[0] = 0.0  # label 0 is everything that was seen
    is_large: NDArray[np.bool_] = square_metres > _SMALLEST_OBSTACLE
    return is_large[areas]
