"""The grid of a drive in progress, updated incrementally.

Settled keyframes are counted once; only the most recent ones are redrawn in every call. When an optimization
moves settled ones, everything is redrawn, over several calls if there is much. The old drawing is shown until
then.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.grid.config import RenderingConfig
from racecar.mapping.grid.evidence import Evidence, tiles_touched
from racecar.mapping.grid.rendering import Rays, kept, touched_by
from racecar.maps.geometry.se2 import Pose, between
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.tiled_grid import TILE, Tile, TiledGrid

_UNSETTLED = 80
"""Number of most recent keyframes redrawn in every call, because the mapper keeps adjusting half as many."""
_MAX_SHIFT = 0.5
"""Cells by which a settled keyframe, or points within its sight, may move before everything is redrawn: half
a cell, because of rounding."""
_SIGHT = 10.0
"""Range in metres at which a keyframe's rotation is judged. Chosen by judgement: what indoor scans see."""
_REDRAWN_AT_ONCE = 200
"""Keyframes redrawn per call, so that the next map comes within a second or so. Measured with 2200 keyframes:
drawn in one call, nothing was published for 3 to 4 s."""


class GrowingGrid:
    """Draws the grid of all keyframes so far; not thread-safe."""

    def __init__(self, resolution: float, rendering: RenderingConfig) -> None:
        self._new_drawing = partial(_Drawing, resolution, rendering)
        self._shown = self._new_drawing()
        self._next: _Drawing | None = None
        """Replaces the current drawing once everything is redrawn."""
        self.redrawn = 0
        """Number of complete redraws after optimizations."""

    def draw(
        self, rays: Sequence[Rays], map_from_laser: Pose, held: tuple[list[Rays], Pose] | None = None
    ) -> OccupancyGrid:
        """Draw rays (K) from poses (K, 3), K at least 1; earlier calls' rays come first.

        ``held`` rays (H) from poses (H, 3) are drawn in this call only.
        """
        until = max(len(rays) - _UNSETTLED, len(self._shown.drawn))
        if self._next is None and self._shown.is_outdated(map_from_laser):
            self.redrawn += 1
            self._next = self._new_drawing()
        if self._next is not None:
            end = _reached(rays, len(self._next.drawn), until)
            self._next.settle(rays, map_from_laser, end)
            if len(self._next.drawn) == until:
                self._shown, self._next = self._next, None
        self._shown.settle(rays, map_from_laser, until)
        if held is not None:
            rays, map_from_laser = [*rays, *held[0]], np.concatenate([map_from_laser, held[1]])
        return self._shown.with_latest(rays, map_from_laser)


class _Drawing:
    """Evidence of the settled keyframes and the resulting cells."""

    def __init__(self, resolution: float, rendering: RenderingConfig) -> None:
        self.resolution = resolution
        self.drawn: Pose = np.zeros((0, 3))
        """Poses at which the settled keyframes were drawn."""
        self._low = np.full(2, np.nan)
        """(2,) metres in the map: corner of cell (0, 0), where the drive began."""
        self._evidence = Evidence(rendering)
        self._cells: dict[Tile, NDArray[np.int8]] = {}

    def is_outdated(self, map_from_laser: Pose) -> bool:
        """Whether the settled keyframes have moved."""
        steps = between(self.drawn, map_from_laser[: len(self.drawn)])
        moved = np.hypot(steps[:, 0], steps[:, 1]) + _SIGHT * np.abs(steps[:, 2])
        return bool(np.any(moved > _MAX_SHIFT * self.resolution))

    def settle(self, rays: Sequence[Rays], map_from_laser: Pose, until: int) -> None:
        """Count the keyframes before ``until`` permanently."""
        first = len(self.drawn)
        if first == 0:
            self._low = np.floor(map_from_laser[0, :2] / self.resolution) * self.resolution
        settled = kept(rays, range(first, until))
        touched = self._touched(settled, rays, map_from_laser)
        self._evidence.count(touched.__getitem__, [rays[k].returns for k in settled])
        self._cells.update(self._evidence.cells(tiles_touched(touched)))
        self.drawn = np.concatenate([self.drawn, map_from_laser[first:until]])

    def with_latest(self, rays: Sequence[Rays], map_from_laser: Pose) -> OccupancyGrid:
        """The grid including unsettled keyframes of (K), which are counted temporarily."""
        latest = range(len(self.drawn), len(rays))
        touched = self._touched(latest, rays, map_from_laser)
        evidence = self._evidence.copy_of(tiles_touched(touched))
        evidence.count(touched.__getitem__, [rays[k].returns for k in latest])
        return self._in_one_piece({**self._cells, **evidence.cells()})

    def _touched(
        self, keyframes: Sequence[int], rays: Sequence[Rays], map_from_laser: Pose
    ) -> list[NDArray[np.float64]]:
        """(N + 1, 2) column and row touched by each of some keyframes."""
        return [(touched_by(rays[k], map_from_laser[k]) - self._low) / self.resolution for k in keyframes]

    def _in_one_piece(self, cells: dict[Tile, NDArray[np.int8]]) -> OccupancyGrid:
        tiles = np.array([Tile(0, 0), *cells])
        first, last = tiles.min(axis=0), tiles.max(axis=0)
        rows, columns = ((last - first + 1) * TILE).tolist()
        x, y = self._low + first[::-1] * TILE * self.resolution
        moved = {Tile(*(np.array(tile) - first).tolist()): cells[tile] for tile in cells}
        return TiledGrid(moved, rows, columns, self.resolution, np.array([x, y, 0.0])).in_one_piece()


def _reached(rays: Sequence[Rays], first: int, until: int) -> int:
    """End of the keyframes to draw in one call, starting at ``first``."""
    seen = kept(rays, range(first, until))
    return until if len(seen) <= _REDRAWN_AT_ONCE else seen[_REDRAWN_AT_ONCE]
