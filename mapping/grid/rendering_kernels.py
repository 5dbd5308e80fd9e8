"""Ray casting of scans into tiles: the inner loop."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.grid.tiled_grid import TILE

_SHIFT = TILE.bit_length() - 1
"""Bits by which a row or column is shifted to become that of its tile, because divisions are slow."""


class Counts(NamedTuple):
    """How many scans hit and passed the cells of some tiles."""

    hits: NDArray[np.uint16]
    """(T, TILE, TILE); 0 in the tiles that are not used yet."""
    passes: NDArray[np.uint16]
    """(T, TILE, TILE)"""
    used: NDArray[np.int64]
    """(1,) how many of the T are used."""


class Window(NamedTuple):
    """The cells that are counted of what a scan touches."""

    first_row: int
    until_row: int
    first_column: int
    until_column: int
    tiles: NDArray[np.int32]
    """(tile rows, tile columns) which of the counts' tiles each is, from the first cell's on; -1 where none
    is yet."""
    marks: NDArray[np.int32]
    """(rows, columns) of the window or more: the last scan that touched a cell."""


@njit(cache=True, nogil=True)
def cast_returns(
    start_column: float,
    start_row: float,
    ends: NDArray[np.float64],
    mark: int,
    window: Window,
    counts: Counts,
) -> None:
    """Count for each cell whether the returns of a scan hit it or, failing that, passed it: once per scan.

    The start and the ``ends`` (N, 2), column and row, are in cells; ``mark`` is a number of the scan's own.
    """
    for i in range(len(ends)):
        c, r = int(np.floor(ends[i, 0])), int(np.floor(ends[i, 1]))
        if _is_in(r, c, window) and window.marks[r - window.first_row, c - window.first_column] != mark:
            window.marks[r - window.first_row, c - window.first_column] = mark
            tile, row, column = _place(r, c, window, counts)
            counts.hits[tile, row, column] += 1
    for i in range(len(ends)):
        _pass(start_column, start_row, ends[i], mark, window, counts, 0.0)


@njit(cache=True, nogil=True)
def cast_misses(
    start_column: float,
    start_row: float,
    ends: NDArray[np.float64],
    returns: int,
    mark: int,
    window: Window,
    counts: Counts,
    passes_per_hit: float,
) -> None:
    """Count the cells that the misses of a scan, its ends after the ``returns``, pass, but not those it hit.

    A cell that is occupied by the counts, with more than one hit in ``passes_per_hit`` passes, ends a miss.
    The other arguments are those of `cast_returns`.
    """
    for i in range(returns):
        c, r = int(np.floor(ends[i, 0])), int(np.floor(ends[i, 1]))
        if _is_in(r, c, window):
            window.marks[r - window.first_row, c - window.first_column] = mark
    for i in range(returns, len(ends)):
        _pass(start_column, start_row, ends[i], mark, window, counts, passes_per_hit)


@njit(cache=True, nogil=True)
def _pass(
    start_column: float,
    start_row: float,
    end: NDArray[np.float64],
    mark: int,
    window: Window,
    counts: Counts,
    passes_per_hit: float,
) -> None:
    """Count the cells that a beam passes, up to an occupied one, if a hit is worth any passes: Amanatides and
    Woo, "A fast voxel traversal algorithm", 1987."""
    dx, dy = end[0] - start_column, end[1] - start_row
    c, r = int(np.floor(start_column)), int(np.floor(start_row))
    last_c, last_r = int(np.floor(end[0])), int(np.floor(end[1]))
    step_c = 1 if dx > 0 else -1
    step_r = 1 if dy > 0 else -1
    delta_c = abs(1.0 / dx) if dx != 0.0 else np.inf
    delta_r = abs(1.0 / dy) if dy != 0.0 else np.inf
    next_c = ((c + 1 - start_column) if dx > 0 else (start_column - c)) * delta_c if dx != 0.0 else np.inf
    next_r = ((r + 1 - start_row) if dy > 0 else (start_row - r)) * delta_r if dy != 0.0 else np.inf
    for _ in range(abs(last_c - c) + abs(last_r - r)):
        if _is_in(r, c, window):
            is_new = window.marks[r - window.first_row, c - window.first_column] != mark
            if is_new or passes_per_hit > 0.0:
                tile, row, column = _place(r, c, window, counts)
                if is_new:
                    window.marks[r - window.first_row, c - window.first_column] = mark
                    counts.passes[tile, row, column] += 1
                if counts.hits[tile, row, column] * passes_per_hit > counts.passes[tile, row, column]:
                    return
        if next_c < next_r:
            next_c += delta_c
            c += step_c
        else:
            next_r += delta_r
            r += step_r


@njit(cache=True, nogil=True)
def _is_in(row: int, column: int, window: Window) -> bool:
    return window.first_row <= row < window.until_row and window.first_column <= column < window.until_column


@njit(cache=True, nogil=True)
def _place(row: int, column: int, window: Window, counts: Counts) -> tuple[int, int, int]:
    """Which of the tiles a cell lies in, which is taken into use for it, and where in it."""
    tile_row = (row >> _SHIFT) - (window.first_row >> _SHIFT)
    tile_column = (column >> _SHIFT) - (window.first_column >> _SHIFT)
    tile = window.tiles[tile_row, tile_column]
    if tile < 0:
        tile = np.int32(counts.used[0])
        counts.used[0] += 1
        window.tiles[tile_row, tile_column] = tile
    return tile, row & (TILE - 1), column & (TILE - 1)
