"""The grid of a drive that is still going on, drawn again and again at little cost.

Keyframes that have settled are counted once and stay; only the latest are drawn afresh each time. When the
graph moves what was drawn, all is drawn anew: over some calls where there is much, and shown as it was until
then.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.grid.rendering import Rays, not_given_up, occupancy
from racecar.mapping.grid.rendering_kernels import cast_scan
from racecar.maps.geometry.se2 import Pose, between, transform_points
from racecar.maps.grid.occupancy_grid import UNKNOWN, OccupancyGrid

_LATEST = 80
"""Keyframes whose poses the mapper still adjusts as a matter of course."""
_MOVED = 0.5
"""Cells by which a settled keyframe may move, or what it sees at ten metres, before all is drawn anew."""
_AT_ONCE = 200
"""Keyframes that are drawn anew in one call, so that the next map comes within a second or so."""
_GROWTH = 10.0
"""Metres of spare room when the grid must grow."""

_Counts = NDArray[np.uint16]


class GrowingGrid:
    """Draws the grid of all keyframes so far; it belongs to one thread."""

    def __init__(self, resolution: float) -> None:
        self._shown = _Canvas(resolution)
        self._anew: _Canvas | None = None
        self.redrawn = 0
        """How often all was drawn anew because the graph had moved it."""

    def draw(self, rays: Sequence[Rays], map_from_laser: Pose) -> OccupancyGrid:
        """The grid that rays (K) seen from poses (K, 3) draw; those of the last call are the first of them.

        K is at least 1.
        """
        until = max(len(rays) - _LATEST, len(self._shown.drawn))
        if self._anew is None and self._shown.is_outdated(map_from_laser):
            self.redrawn += 1
            self._anew = _Canvas(self._shown.resolution)
        if self._anew is not None:
            self._anew.settle(rays, map_from_laser, _reached(rays, len(self._anew.drawn), until))
            if len(self._anew.drawn) == until:
                self._shown, self._anew = self._anew, None
        self._shown.settle(rays, map_from_laser, until)
        return self._shown.with_latest(rays, map_from_laser)


class _Canvas:
    """Counts of the settled keyframes, and the cells that were shown last."""

    def __init__(self, resolution: float) -> None:
        self.resolution = resolution
        self.drawn: Pose = np.zeros((0, 3))
        """Of the settled keyframes, as each was drawn."""
        self._hits: _Counts = np.zeros((0, 0), dtype=np.uint16)
        self._passes: _Counts = np.zeros((0, 0), dtype=np.uint16)
        self._low = np.full(2, np.nan)
        self._marks = np.zeros((0, 0), dtype=np.int32)
        self._mark = 0
        self._cells = np.zeros((0, 0), dtype=np.int8)
        self._dirty = _Box()

    def is_outdated(self, map_from_laser: Pose) -> bool:
        """Do the settled keyframes lie elsewhere now?"""
        steps = between(self.drawn, map_from_laser[: len(self.drawn)])
        moved = np.hypot(steps[:, 0], steps[:, 1]) + 10.0 * np.abs(steps[:, 2])
        return bool(np.any(moved > _MOVED * self.resolution))

    def settle(self, rays: Sequence[Rays], map_from_laser: Pose, until: int) -> None:
        """Count the keyframes before one for good."""
        first = len(self.drawn)
        for k in not_given_up(rays, range(first, until)):
            touched = _touched(rays[k], map_from_laser[k])
            self._make_room(touched)
            self._count(touched, rays[k].returns, self._hits, self._passes)
        self.drawn = np.concatenate([self.drawn, map_from_laser[first:until]])

    def with_latest(self, rays: Sequence[Rays], map_from_laser: Pose) -> OccupancyGrid:
        """The grid with the keyframes (K) that have not settled, which are not kept."""
        latest = range(len(self.drawn), len(rays))
        touched = [_touched(rays[k], map_from_laser[k]) for k in latest]
        for points in touched:
            self._make_room(points)
        hits, passes = self._hits.copy(), self._passes.copy()
        outdated, self._dirty = self._dirty, _Box()
        for k, points in zip(latest, touched, strict=True):
            self._count(points, rays[k].returns, hits, passes)
        outdated.include(self._dirty)
        box = outdated.slices()
        self._cells[box] = occupancy(hits[box], passes[box])
        return OccupancyGrid(self._cells.copy(), self.resolution, np.append(self._low, 0.0))

    def _make_room(self, points: NDArray[np.float64]) -> None:
        """Let the grid grow until it holds points (N, 2) of the map."""
        low, high = points.min(axis=0), points.max(axis=0)
        if np.isnan(self._low[0]):
            self._low = np.floor(low / self.resolution) * self.resolution
        size = np.array(self._cells.shape[::-1]) * self.resolution
        before, after = self._spare(self._low - low), self._spare(high - (self._low + size))
        if not np.any(before) and not np.any(after):
            return
        self._low = self._low - before * self.resolution
        padding = list(zip(before[::-1].tolist(), after[::-1].tolist(), strict=True))
        self._hits, self._passes = np.pad(self._hits, padding), np.pad(self._passes, padding)
        self._marks = np.pad(self._marks, padding)
        self._cells = np.pad(self._cells, padding, constant_values=UNKNOWN)
        self._dirty.move(before[::-1])

    def _count(self, touched: NDArray[np.float64], returns: int, hits: _Counts, passes: _Counts) -> None:
        """Count what a keyframe hits and passes, from the points (N + 1, 2) that it touched."""
        self._mark += 1
        touched = (touched - self._low) / self.resolution
        ends, (column, row) = touched[:-1], touched[-1]
        is_hit = np.arange(len(ends)) < returns
        cast_scan(column, row, ends, is_hit, self._mark, self._marks, hits, passes)
        self._dirty.add(np.floor(touched[:, ::-1]).astype(np.int64))

    def _spare(self, missing: NDArray[np.float64]) -> NDArray[np.int64]:
        """Cells to add on a side, from the metres that are missing there."""
        wanted = np.where(missing >= 0.0, missing + _GROWTH, 0.0)
        return np.ceil(wanted / self.resolution).astype(np.int64)


class _Box:
    """Rows and columns within which the cells shown are not what is counted."""

    def __init__(self) -> None:
        self._low, self._high = np.full(2, 2**30), np.full(2, -(2**30))

    def add(self, cells: NDArray[np.int64]) -> None:
        """Let it hold cells (N, 2), row and column."""
        self._low = np.minimum(self._low, cells.min(axis=0))
        self._high = np.maximum(self._high, cells.max(axis=0) + 1)

    def include(self, other: "_Box") -> None:
        """Let it hold another box."""
        self._low, self._high = np.minimum(self._low, other._low), np.maximum(self._high, other._high)

    def move(self, cells: NDArray[np.int64]) -> None:
        """Follow the grid when it grows by so many rows and columns before the first."""
        self._low, self._high = self._low + cells, self._high + cells

    def slices(self) -> tuple[slice, slice]:
        """What to index the grid with."""
        (first_row, first_column), (last_row, last_column) = self._low.tolist(), self._high.tolist()
        return slice(first_row, last_row), slice(first_column, last_column)


def _reached(rays: Sequence[Rays], first: int, until: int) -> int:
    """The keyframe before which those to be drawn in one call end, from the first on."""
    seen = not_given_up(rays, range(first, until))
    return until if len(seen) <= _AT_ONCE else seen[_AT_ONCE]


def _touched(ray: Rays, pose: Pose) -> NDArray[np.float64]:
    """(N + 1, 2) where the rays of a keyframe end, and at last where they begin."""
    return np.concatenate([transform_points(pose, ray.ends), pose[None, :2]])
