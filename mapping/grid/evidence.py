"""Hits and passes of each cell, counted in tiles that are allocated where beams go."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.grid.config import RenderingConfig
from racecar.mapping.grid.log_odds import log_odds, occupancy, settle
from racecar.mapping.grid.rendering_kernels import Canvas, cast_misses, cast_returns
from racecar.maps.grid.tiled_grid import TILE, Tile, tiles_in

Box = tuple[slice, slice]
"""Rows and columns, which may be negative."""


class Evidence:
    """Counts of scans at arbitrary rows and columns; not thread-safe."""

    def __init__(self, config: RenderingConfig, most_tiles: int = 0) -> None:
        """Reserve memory for ``most_tiles``, committed when used. Without it the counts are reallocated as
        they grow, which briefly takes twice the memory."""
        self._config = config
        self._index: NDArray[np.int32] = np.zeros((0, 0), dtype=np.int32)
        """(tile rows, tile columns) indices into the counts, -1 for tiles that do not exist."""
        self._first = Tile(0, 0)
        """Tile at the origin of the index."""
        self._hits, self._passes = _no_counts(most_tiles), _no_counts(most_tiles)
        """(T, TILE, TILE)"""
        self._used = np.zeros(1, dtype=np.int64)
        """(1,) number of used tiles; the rest of T is reserved."""
        self._marks: NDArray[np.int32] = np.zeros((0, 0), dtype=np.int32)
        self._mark = 0

    def count(
        self,
        touched: Callable[[int], NDArray[np.float64]],
        returns: Sequence[int],
        within: Box | None = None,
    ) -> None:
        """Count the cells that scans (K) hit and passed, optionally only ``within`` some rows and columns.

        ``touched`` gives fractional column and row (N + 1, 2) of a scan: the first are ``returns`` (K), then
        the ends of misses, and last the laser. It may be called twice per scan, since results for a day's
        scans take hundreds of megabytes.

        Returns are counted first, because a miss ends at a wall that they show: its beam may have been lost
        there, on glass or black paint, and says nothing about what is behind.
        """
        with_misses = []
        for scan, count in enumerate(returns):
            cells = touched(scan)
            if count < len(cells) - 1:
                with_misses.append(scan)
            if (canvas := self._canvas(cells, within)) is not None:
                cast_returns(cells[-1], cells[:count], canvas)
        hit, passed = log_odds(self._config.hit_probability), log_odds(self._config.pass_probability)
        for scan in with_misses:
            cells = touched(scan)
            if (canvas := self._canvas(cells, within)) is not None:
                cast_misses(cells[-1], cells[:-1], returns[scan], float(-hit / passed), canvas)

    def settle(self) -> None:
        """Clamp the evidence so far, so that a later drive can soon overrule it. Clamped evidence is
        forgotten where something contradicts it and nowhere else (Yguel, Aycard and Laugier, "Update policy
        of dense maps", 2008)."""
        for number in range(int(self._used[0])):
            settle(self._hits[number], self._passes[number], self._config)

    def cells(self, tiles: Iterable[Tile] | None = None) -> dict[Tile, NDArray[np.int8]]:
        """Percent occupied, or unknown, of the cells of each tile, optionally only of some tiles."""
        numbers = self._numbers()
        known = numbers if tiles is None else [tile for tile in tiles if tile in numbers]
        return {
            tile: occupancy(self._hits[numbers[tile]], self._passes[numbers[tile]], self._config)
            for tile in known
        }

    def copy_of(self, tiles: Iterable[Tile]) -> "Evidence":
        """A copy of the evidence in some tiles, for counting without changing this one."""
        numbers = self._numbers()
        known = [tile for tile in tiles if tile in numbers]
        copy = Evidence(self._config)
        if known:
            rows, columns = np.array(known).T
            copy._reach_over(*(slice(each.min(), each.max() + 1) for each in (rows, columns)))
            copy._set_aside(len(known))
            copy._index[rows - copy._first.row, columns - copy._first.column] = np.arange(len(known))
            copied = [numbers[tile] for tile in known]
            copy._hits[: len(known)], copy._passes[: len(known)] = self._hits[copied], self._passes[copied]
            copy._used[0] = len(known)
        return copy

    def _numbers(self) -> dict[Tile, int]:
        places = np.argwhere(self._index >= 0)
        numbers = self._index[tuple(places.T)].tolist()
        tiles = [Tile(*place) for place in (places + self._first).tolist()]
        return dict(zip(tiles, numbers, strict=True))

    def _canvas(self, cells: NDArray[np.float64], within: Box | None) -> Canvas | None:
        """The canvas for the next scan, given what it touches, after allocating tiles; None where nothing is
        counted."""
        rows, columns = box_of(cells)
        if within is not None:
            rows, columns = _common(rows, within[0]), _common(columns, within[1])
            if rows.start >= rows.stop or columns.start >= columns.stop:
                return None
        new_tiles = self._reach_over(
            *(slice(each.start // TILE, -(-each.stop // TILE)) for each in (rows, columns))
        )
        self._set_aside(int(self._used[0]) + new_tiles)
        height, width = rows.stop - rows.start, columns.stop - columns.start
        if height > self._marks.shape[0] or width > self._marks.shape[1]:
            self._marks = np.zeros(np.maximum(self._marks.shape, (height, width)), dtype=np.int32)
        self._mark += 1
        window = rows.start, rows.stop, columns.start, columns.stop
        counts = self._hits, self._passes, self._used
        return Canvas(self._mark, window, self._first, self._index, self._marks, *counts)

    def _reach_over(self, rows: slice, columns: slice) -> int:
        """Extend the index to some rows and columns of tiles; returns how many of them do not exist yet."""
        if self._index.size == 0:
            self._first = Tile(rows.start, columns.start)
        before = [max(0, self._first.row - rows.start), max(0, self._first.column - columns.start)]
        after = [
            max(0, rows.stop - self._first.row - self._index.shape[0]),
            max(0, columns.stop - self._first.column - self._index.shape[1]),
        ]
        if any(before) or any(after):
            self._index = np.pad(self._index, list(zip(before, after, strict=True)), constant_values=-1)
            self._first = Tile(self._first.row - before[0], self._first.column - before[1])
        row, column = self._first
        part = self._index[rows.start - row : rows.stop - row, columns.start - column : columns.stop - column]
        return int(np.count_nonzero(part < 0))

    def _set_aside(self, tiles: int) -> None:
        """Reserve memory for this many tiles."""
        if tiles <= len(self._hits):
            return
        used, hits, passes = int(self._used[0]), self._hits, self._passes
        self._hits, self._passes = _no_counts(2 * tiles), _no_counts(2 * tiles)
        self._hits[:used], self._passes[:used] = hits[:used], passes[:used]


def box_of(cells: NDArray[np.float64]) -> Box:
    """Rows and columns touched by a scan, from the ends of its beams (N, 2), column and row."""
    first = np.floor(cells.min(axis=0)).astype(np.int64)
    until = np.floor(cells.max(axis=0)).astype(np.int64) + 1
    return slice(int(first[1]), int(until[1])), slice(int(first[0]), int(until[0]))


def tiles_touched(touched: Iterable[NDArray[np.float64]]) -> set[Tile]:
    """Tiles that scans may touch, given their touched points."""
    return {tile for cells in touched for tile in tiles_in(*box_of(cells))}


def _common(one: slice, other: slice) -> slice:
    return slice(max(one.start, other.start), min(one.stop, other.stop))


def _no_counts(tiles: int) -> NDArray[np.uint16]:
    return np.zeros((tiles, TILE, TILE), dtype=np.uint16)
