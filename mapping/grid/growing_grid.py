"""The grid of a drive that is still going on, updated again and again at little cost.

Keyframes that have settled are counted once for good; only the latest are drawn afresh each time. When the
graph moves what was drawn, everything is redrawn: over several calls where there is much, and the old drawing
is shown until then.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.grid.config import GrowingGridConfig, RenderingConfig
from racecar.mapping.grid.rendering import Rays, cast, kept, occupancy, touched_by
from racecar.maps.geometry.se2 import Pose, between
from racecar.maps.grid.occupancy_grid import UNKNOWN, OccupancyGrid

_Counts = NDArray[np.uint16]


class GrowingGrid:
    """Draws the grid of all keyframes so far; it belongs to one thread."""

    def __init__(self, resolution: float, rendering: RenderingConfig, config: GrowingGridConfig) -> None:
        self._new_canvas = partial(_Canvas, resolution, rendering, config)
        self._config = config
        self._shown = self._new_canvas()
        self._next: _Canvas | None = None
        """What replaces the shown one once all is redrawn."""
        self.redrawn = 0
        """How often everything was redrawn because the graph had moved it."""

    def draw(
        self, rays: Sequence[Rays], map_from_laser: Pose, held: tuple[list[Rays], Pose] | None = None
    ) -> OccupancyGrid:
        """The grid that rays (K) seen from poses (K, 3) draw; those of the last call are the first of them.

        K is at least 1. What is ``held``, rays (H) and poses (H, 3), counts for this call only.
        """
        until = max(len(rays) - self._config.unsettled_keyframes, len(self._shown.drawn))
        if self._next is None and self._shown.is_outdated(map_from_laser):
            self.redrawn += 1
            self._next = self._new_canvas()
        if self._next is not None:
            end = _reached(rays, len(self._next.drawn), until, self._config.redrawn_at_once)
            self._next.settle(rays, map_from_laser, end)
            if len(self._next.drawn) == until:
                self._shown, self._next = self._next, None
        self._shown.settle(rays, map_from_laser, until)
        if held is not None:
            rays, map_from_laser = [*rays, *held[0]], np.concatenate([map_from_laser, held[1]])
        return self._shown.with_latest(rays, map_from_laser)


class _Canvas:
    """Counts of the settled keyframes, and the cells that were shown last."""

    def __init__(self, resolution: float, rendering: RenderingConfig, config: GrowingGridConfig) -> None:
        self.resolution = resolution
        self._rendering, self._config = rendering, config
        self.drawn: Pose = np.zeros((0, 3))
        """Poses of the settled keyframes, as each was drawn."""
        self._hits: _Counts = np.zeros((0, 0), dtype=np.uint16)
        self._passes: _Counts = np.zeros((0, 0), dtype=np.uint16)
        self._low = np.full(2, np.nan)
        self._marks = np.zeros((0, 0), dtype=np.int32)
        self._mark = 1
        self._cells = np.zeros((0, 0), dtype=np.int8)
        self._dirty = _Box()

    def is_outdated(self, map_from_laser: Pose) -> bool:
        """Do the settled keyframes lie elsewhere now?"""
        steps = between(self.drawn, map_from_laser[: len(self.drawn)])
        moved = np.hypot(steps[:, 0], steps[:, 1]) + self._config.sight * np.abs(steps[:, 2])
        return bool(np.any(moved > self._config.max_shift * self.resolution))

    def settle(self, rays: Sequence[Rays], map_from_laser: Pose, until: int) -> None:
        """Count the keyframes before one for good."""
        first = len(self.drawn)
        settled = kept(rays, range(first, until))
        touched = self._with_room_for(settled, rays, map_from_laser)
        self._count(touched, [rays[k].returns for k in settled], self._hits, self._passes)
        self.drawn = np.concatenate([self.drawn, map_from_laser[first:until]])

    def with_latest(self, rays: Sequence[Rays], map_from_laser: Pose) -> OccupancyGrid:
        """The grid with the keyframes (K) that have not settled, whose counts are dropped again."""
        latest = range(len(self.drawn), len(rays))
        touched = self._with_room_for(latest, rays, map_from_laser)
        hits, passes = self._hits.copy(), self._passes.copy()
        outdated, self._dirty = self._dirty, _Box()
        self._count(touched, [rays[k].returns for k in latest], hits, passes)
        outdated.include(self._dirty)
        box = outdated.slices()
        self._cells[box] = occupancy(hits[box], passes[box], self._rendering)
        return OccupancyGrid(self._cells.copy(), self.resolution, np.append(self._low, 0.0))

    def _with_room_for(
        self, keyframes: Sequence[int], rays: Sequence[Rays], map_from_laser: Pose
    ) -> list[NDArray[np.float64]]:
        """Grow the grid until it contains what some keyframes touch: (N + 1, 2) of the map each."""
        touched = [touched_by(rays[k], map_from_laser[k]) for k in keyframes]
        for points in touched:
            self._make_room(points)
        return touched

    def _make_room(self, points: NDArray[np.float64]) -> None:
        """Grow the grid until it contains points (N, 2) of the map."""
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

    def _count(
        self, touched: Sequence[NDArray[np.float64]], returns: Sequence[int], hits: _Counts, passes: _Counts
    ) -> None:
        """Count the cells that keyframes hit and pass, from the points (N + 1, 2) that each touched."""
        cells = [(points - self._low) / self.resolution for points in touched]
        cast(cells, returns, self._mark, self._marks, hits, passes, self._rendering)
        self._mark += 2 * len(cells)
        for each in cells:
            self._dirty.add(np.floor(each[:, ::-1]).astype(np.int64))

    def _spare(self, missing: NDArray[np.float64]) -> NDArray[np.int64]:
        """Cells to add on a side, from the metres that are missing there."""
        wanted = np.where(missing >= 0.0, missing + self._config.growth, 0.0)
        return np.ceil(wanted / self.resolution).astype(np.int64)


class _Box:
    """The rows and columns whose cells have to be computed from the counts again."""

    def __init__(self) -> None:
        # Empty: beyond any grid, the wrong way round.
        self._low, self._high = np.full(2, 2**30), np.full(2, -(2**30))

    def add(self, cells: NDArray[np.int64]) -> None:
        """Extend it to contain cells (N, 2), row and column."""
        self._low = np.minimum(self._low, cells.min(axis=0))
        self._high = np.maximum(self._high, cells.max(axis=0) + 1)

    def include(self, other: "_Box") -> None:
        """Extend it to contain another box."""
        self._low, self._high = np.minimum(self._low, other._low), np.maximum(self._high, other._high)

    def move(self, cells: NDArray[np.int64]) -> None:
        """Follow the grid when it grows by ``cells`` (2,) rows and columns before the first."""
        self._low, self._high = self._low + cells, self._high + cells

    def slices(self) -> tuple[slice, slice]:
        """The box as an index into the grid."""
        (first_row, first_column), (last_row, last_column) = self._low.tolist(), self._high.tolist()
        return slice(first_row, last_row), slice(first_column, last_column)


def _reached(rays: Sequence[Rays], first: int, until: int, most: int) -> int:
    """The keyframe before which those to be drawn in one call end: from the first on, at most so many."""
    seen = kept(rays, range(first, until))
    return until if len(seen) <= most else seen[most]
