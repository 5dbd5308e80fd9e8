"""Ray casting of scans into tiles: the inner loop."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.grid.tiled_grid import TILE

_SHIFT = TILE.bit_length() - 1
"""Bits by which a row or column is shifted to become that of its tile, because divisions are slow."""
_WITHIN = TILE - 1
"""Bits of a row or column that say where in its tile it lies, because divisions are slow."""


class Canvas(NamedTuple):
    """What a scan is counted on."""

    mark: int
    """Of this scan, by which cells remember that it touched them."""
    window: tuple[int, int, int, int]
    """The cells that are counted: the first row and the one after the last, the same of columns."""
    first_tile: tuple[int, int]
    """Row and column of the first of the tiles; that with cell (0, 0) has 0 and 0."""
    tiles: NDArray[np.int32]
    """(tile rows, tile columns) which of the counts' tiles each is, -1 where none is yet."""
    marks: NDArray[np.int32]
    """(rows, columns) of the window: the last scan that touched each cell."""
    hits: NDArray[np.uint16]
    """(T, TILE, TILE) 0 in the tiles that are not used yet."""
    passes: NDArray[np.uint16]
    """The same."""
    used: NDArray[np.int64]
    """(1,) how many of the T are used."""


@njit(cache=True, nogil=True)
def cast_returns(start: NDArray[np.float64], ends: NDArray[np.float64], canvas: Canvas) -> None:
    """Count for each cell whether the returns of a scan hit it or, failing that, passed it: once per scan.

    The start (2,) and the ``ends`` (N, 2), column and row, are in cells.
    """
    first_row, until_row, first_column, until_column = canvas.window
    marks, mark = canvas.marks, canvas.mark
    for i in range(len(ends)):
        c, r = int(np.floor(ends[i, 0])), int(np.floor(ends[i, 1]))
        if not (first_row <= r < until_row and first_column <= c < until_column):
            continue
        if marks[r - first_row, c - first_column] != mark:
            marks[r - first_row, c - first_column] = mark
            canvas.hits[_tile_of(r, c, canvas), r & _WITHIN, c & _WITHIN] += 1
    for i in range(len(ends)):
        _pass(start, ends[i], 0.0, canvas)


@njit(cache=True, nogil=True)
def cast_misses(
    start: NDArray[np.float64],
    ends: NDArray[np.float64],
    returns: int,
    passes_per_hit: float,
    canvas: Canvas,
) -> None:
    """Count the cells that the misses of a scan, its ends after the ``returns``, pass, but not those it hit.

    A cell that is occupied by the counts, with more than one hit in ``passes_per_hit`` passes, ends a miss.
    """
    first_row, until_row, first_column, until_column = canvas.window
    for i in range(returns):
        c, r = int(np.floor(ends[i, 0])), int(np.floor(ends[i, 1]))
        if first_row <= r < until_row and first_column <= c < until_column:
            canvas.marks[r - first_row, c - first_column] = canvas.mark
    for i in range(returns, len(ends)):
        _pass(start, ends[i], passes_per_hit, canvas)


@njit(cache=True, nogil=True)
def _pass(
    start: NDArray[np.float64], end: NDArray[np.float64], passes_per_hit: float, canvas: Canvas
) -> None:
    """Count the cells that a beam passes, up to an occupied one, if a hit is worth any passes: Amanatides and
    Woo, "A fast voxel traversal algorithm", 1987."""
    first_row, until_row, first_column, until_column = canvas.window
    marks, mark, hits, passes = canvas.marks, canvas.mark, canvas.hits, canvas.passes
    start_column, start_row = start[0], start[1]
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
        if first_row <= r < until_row and first_column <= c < until_column:
            is_new = marks[r - first_row, c - first_column] != mark
            if is_new or passes_per_hit > 0.0:
                tile, row, column = _tile_of(r, c, canvas), r & _WITHIN, c & _WITHIN
                if is_new:
                    marks[r - first_row, c - first_column] = mark
                    passes[tile, row, column] += 1
                if hits[tile, row, column] * passes_per_hit > passes[tile, row, column]:
                    return
        if next_c < next_r:
            next_c += delta_c
            c += step_c
        else:
            next_r += delta_r
            r += step_r


@njit(cache=True, nogil=True)
def _tile_of(row: int, column: int, canvas: Canvas) -> int:
    """Which of the counts' tiles a cell lies in; the next one is taken into use where there is none yet."""
    tile_row, tile_column = (row >> _SHIFT) - canvas.first_tile[0], (column >> _SHIFT) - canvas.first_tile[1]
    if canvas.tiles[tile_row, tile_column] < 0:
        canvas.tiles[tile_row, tile_column] = canvas.used[0]
        canvas.used[0] += 1
    return int(canvas.tiles[tile_row, tile_column])
