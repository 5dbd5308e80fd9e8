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
from maps.se2 import IDENTITY, Pose, between, transform_points

_LATEST = 80
"""Keyframes whose poses the mapper still adjusts as a matter of course."""
_MOVED = 0.5
"""Cells by which a settled keyframe may move, or what it sees at ten metres, before all is drawn anew."""
_GROWTH = 10.0
"""Metres by which the grid grows at least."""


class GrowingGrid:
    """Draws the grid of all keyframes so far; it belongs to one thread."""

    def __init__(self, resolution: float) -> None:
        self._resolution = resolution
        self.redrawn = 0
        """How often all was drawn anew because the graph moved it."""
        self._start_anew()

    def draw(self, rays: Sequence[Rays], map_from_laser: Pose) -> OccupancyGrid:
        """The grid that rays (K) seen from poses (K, 3) draw; the keyframes of the last call are among them.

        K is at least 1.
        """
        if self._has_moved(map_from_laser):
            self.redrawn += 1
            self._start_anew()
        settled = max(len(rays) - _LATEST, len(self._drawn))
        for index in range(len(self._drawn), settled):
            self._fit(self._ends(rays[index], map_from_laser[index]))
            self._count(rays[index], map_from_laser[index], self._hits, self._passes)
        self._drawn = map_from_laser[:settled].copy()
        for index in range(settled, len(rays)):
            self._fit(self._ends(rays[index], map_from_laser[index]))
        return self._with_latest(rays[settled:], map_from_laser[settled:])

    def _start_anew(self) -> None:
        self._drawn: Pose = np.zeros((0, 3))
        self._low: NDArray[np.float64] | None = None
        self._hits = np.zeros((0, 0), dtype=np.uint16)
        self._passes = np.zeros((0, 0), dtype=np.uint16)
        self._marks = np.zeros((0, 0), dtype=np.int32)
        self._cells = np.zeros((0, 0), dtype=np.int8)
        self._mark = 0
        self._clean_dirt()

    def _has_moved(self, map_from_laser: Pose) -> bool:
        steps = between(self._drawn, map_from_laser[: len(self._drawn)])
        moved = np.hypot(steps[:, 0], steps[:, 1]) + 10.0 * np.abs(steps[:, 2])
        return bool(np.any(moved > _MOVED * self._resolution))

    def _ends(self, ray: Rays, pose: Pose) -> NDArray[np.float64]:
        return np.concatenate([transform_points(pose, ray.ends), pose[None, :2]])

    def _fit(self, points: NDArray[np.float64]) -> None:
        """Let the grid grow until it holds points (N, 2), with room to spare."""
        low, high = points.min(axis=0), points.max(axis=0)
        if self._low is None:
            self._low = np.floor(low / self._resolution) * self._resolution
        size = np.array(self._cells.shape[::-1]) * self._resolution
        room = np.maximum(self._low - low, 0.0), np.maximum(high - (self._low + size), 0.0)
        if not np.any(room):
            return
        before, after = (
            np.where(side > 0.0, np.ceil((side + _GROWTH) / self._resolution), 0.0).astype(np.int64)
            for side in room
        )
        self._low = self._low - before * self._resolution
        padding = list(zip(before[::-1].tolist(), after[::-1].tolist(), strict=True))
        self._hits, self._passes = np.pad(self._hits, padding), np.pad(self._passes, padding)
        self._marks = np.pad(self._marks, padding, constant_values=0)
        self._cells = np.pad(self._cells, padding, constant_values=UNKNOWN)
        shift = before[::-1]
        self._dirt = (self._dirt[0] + shift, self._dirt[1] + shift)

    def _count(self, ray: Rays, pose: Pose, hits: NDArray[np.uint16], passes: NDArray[np.uint16]) -> None:
        assert self._low is not None
        self._mark += 1
        ends = (transform_points(pose, ray.ends) - self._low) / self._resolution
        column, row = (pose[:2] - self._low) / self._resolution
        is_hit = np.arange(len(ends)) < ray.returns
        cast_scan(column, row, ends, is_hit, self._mark, self._marks, hits, passes)
        touched = np.floor(np.concatenate([ends, [[column, row]]]))[:, ::-1].astype(np.int64)
        low, high = self._dirt
        self._dirt = np.minimum(low, touched.min(axis=0)), np.maximum(high, touched.max(axis=0) + 1)

    def _clean_dirt(self) -> None:
        """Forget the box of cells, low and high row and column, that the counts do not agree with."""
        self._dirt = np.full(2, 2**30, dtype=np.int64), np.zeros(2, dtype=np.int64)

    def _with_latest(self, rays: Sequence[Rays], map_from_laser: Pose) -> OccupancyGrid:
        assert self._low is not None
        hits, passes = self._hits.copy(), self._passes.copy()
        drawn_over = self._dirt
        self._clean_dirt()
        for ray, pose in zip(rays, map_from_laser, strict=True):
            self._count(ray, pose, hits, passes)
        low = np.maximum(np.minimum(drawn_over[0], self._dirt[0]), 0)
        high = np.maximum(drawn_over[1], self._dirt[1])
        box = slice(low[0], high[0]), slice(low[1], high[1])
        self._cells[box] = occupancy(hits[box], passes[box])
        return OccupancyGrid(self._cells.copy(), self._resolution, np.array([*self._low, IDENTITY[2]]))
