"""Cast the rays of scans into tiles: the inner loop."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.grid.tiled_grid import TILE

_SHIFT = TILE.bit_length() - 1
"""Bit shift from a row or column to that of its tile, because divisions are slow."""
_WITHIN = TILE - 1
"""Bit mask from a row or column to its offset in the tile, because divisions are slow."""


class Canvas(NamedTuple):
    """The area and the counts that a scan is drawn on."""

    mark: int
    """Id of this scan, stored in the cells it touches."""
    window: tuple[int, int, int, int]
    """Counted cells: first and end row, first and end column."""
    first_tile: tuple[int, int]
    """Row and column of the first of the tiles; cell (0, 0) is in tile (0, 0)."""
    tiles: NDArray[np.int32]
    """(tile rows, tile columns) indices into the counts, -1 for tiles that do not exist."""
    marks: NDArray[np.int32]
    """(rows, columns) of the window: the last scan that touched each cell."""
    hits: NDArray[np.uint16]
    """(T, TILE, TILE) hits; zero in unused tiles."""
    passes: NDArray[np.uint16]
    """(T, TILE, TILE) passes, likewise."""
    used: NDArray[np.int64]
    """(1,) number of used tiles."""


@njit(cache=True, nogil=True)
def cast_returns(start: NDArray[np.float64], ends: NDArray[np.float64], canvas: Canvas) -> None:
    """Count for each cell whether the returns of a scan hit it or, failing that, passed it: once per scan.

    ``start`` (2,) and ``ends`` (N, 2) are column and row in cells.
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
    """Count cells passed by the misses of a scan, whose ends follow the ``returns``, except for hit cells.

    A miss ends at an occupied cell: one with more than one hit per ``passes_per_hit`` passes.
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
    """Count the cells that a beam passes, up to an occupied one if ``passes_per_hit`` is positive: Amanatides
    and Woo, "A fast voxel traversal algorithm", 1987."""
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
    """Index of a cell's tile in the counts; takes the next free one if the tile does not exist."""
    tile_row, tile_column = (row >> _SHIFT) - canvas.first_tile[0], (column >> _SHIFT) - canvas.first_tile[1]
    if canvas.tiles[tile_row, tile_column] < 0:
        canvas.tiles[tile_row, tile_column] = canvas.used[0]
        canvas.used[0] += 1
    return int(canvas.tiles[tile_row, tile_column])
