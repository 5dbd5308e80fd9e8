"""The grid of a drive that is still going on, drawn again and again at little cost.

Keyframes that have settled are counted once and stay; only the latest are drawn afresh each time. When the
graph moves what was drawn, all is drawn anew.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mapping.rendering import Rays, occupancy
from mapping.rendering_kernels import cast_scan
from maps.occupancy_grid import UNKNOWN, OccupancyGrid
from maps.se2 import Pose, between, transform_points

_LATEST = 80
"""Keyframes whose poses the mapper still adjusts as a matter of course."""
_MOVED = 0.5
"""Cells by which a settled keyframe may move, or what it sees at ten metres, before all is drawn anew."""
_GROWTH = 10.0
"""Metres of spare room when the grid must grow."""

_Counts = NDArray[np.uint16]


class GrowingGrid:
    """Draws the grid of all keyframes so far; it belongs to one thread."""

    def __init__(self, resolution: float) -> None:
        self._canvas = _Canvas(resolution)
        self._drawn: Pose = np.zeros((0, 3))
        self.redrawn = 0
        """How often all was drawn anew because the graph had moved it."""

    def draw(self, rays: Sequence[Rays], map_from_laser: Pose) -> OccupancyGrid:
        """The grid that rays (K) seen from poses (K, 3) draw; those of the last call are the first of them.

        K is at least 1.
        """
        canvas = self._canvas
        if self._has_moved(map_from_laser):
            self.redrawn += 1
            self._canvas = canvas = _Canvas(canvas.resolution)
            self._drawn = self._drawn[:0]
        settled = max(len(rays) - _LATEST, len(self._drawn))
        for index in range(len(self._drawn), len(rays)):
            canvas.make_room(_touched(rays[index], map_from_laser[index]))
        for index in range(len(self._drawn), settled):
            canvas.count(rays[index], map_from_laser[index], canvas.hits, canvas.passes)
        self._drawn = map_from_laser[:settled].copy()
        return canvas.with_latest(rays[settled:], map_from_laser[settled:])

    def _has_moved(self, map_from_laser: Pose) -> bool:
        steps = between(self._drawn, map_from_laser[: len(self._drawn)])
        moved = np.hypot(steps[:, 0], steps[:, 1]) + 10.0 * np.abs(steps[:, 2])
        return bool(np.any(moved > _MOVED * self._canvas.resolution))


class _Canvas:
    """Counts of the settled keyframes, and the cells that were shown last."""

    def __init__(self, resolution: float) -> None:
        self.resolution = resolution
        self.hits: _Counts = np.zeros((0, 0), dtype=np.uint16)
        self.passes: _Counts = np.zeros((0, 0), dtype=np.uint16)
        self._low = np.full(2, np.nan)
        self._marks = np.zeros((0, 0), dtype=np.int32)
        self._mark = 0
        self._cells = np.zeros((0, 0), dtype=np.int8)
        self._dirty = _Box()

    def make_room(self, points: NDArray[np.float64]) -> None:
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
        self.hits, self.passes = np.pad(self.hits, padding), np.pad(self.passes, padding)
        self._marks = np.pad(self._marks, padding)
        self._cells = np.pad(self._cells, padding, constant_values=UNKNOWN)
        self._dirty.move(before[::-1])

    def count(self, ray: Rays, pose: Pose, hits: _Counts, passes: _Counts) -> None:
        """Count what a keyframe hits and passes."""
        self._mark += 1
        touched = (_touched(ray, pose) - self._low) / self.resolution
        ends, (column, row) = touched[:-1], touched[-1]
        is_hit = np.arange(len(ends)) < ray.returns
        cast_scan(column, row, ends, is_hit, self._mark, self._marks, hits, passes)
        self._dirty.add(np.floor(touched[:, ::-1]).astype(np.int64))

    def with_latest(self, rays: Sequence[Rays], map_from_laser: Pose) -> OccupancyGrid:
        """The grid with some keyframes more, which are not kept."""
        hits, passes = self.hits.copy(), self.passes.copy()
        outdated, self._dirty = self._dirty, _Box()
        for ray, pose in zip(rays, map_from_laser, strict=True):
            self.count(ray, pose, hits, passes)
        outdated.include(self._dirty)
        box = outdated.slices()
        self._cells[box] = occupancy(hits[box], passes[box])
        return OccupancyGrid(self._cells.copy(), self.resolution, np.append(self._low, 0.0))

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


def _touched(ray: Rays, pose: Pose) -> NDArray[np.float64]:
    """(N + 1, 2) where the rays of a keyframe end, and at last where they begin."""
    return np.concatenate([transform_points(pose, ray.ends), pose[None, :2]])
