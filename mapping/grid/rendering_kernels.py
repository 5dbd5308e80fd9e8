"""Ray casting of scans into tiles: the inner loop.

A scan is counted within a ``window`` of cells: its first row and the one after its last, the same of columns.
In ``index`` (tile rows, tile columns), whose ``first_tile`` is so many tiles up and to the right of that with
cell (0, 0), stands which of the counts' tiles each is, -1 where none is yet. The counts, ``hits`` and
``passes`` (T, TILE, TILE), are 0 in the tiles that are not used yet; how many are, ``used`` (1,) says. In
``marks`` (rows, columns), the cells of the window remember the last scan that touched them, by a ``mark`` of
its own.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.grid.tiled_grid import TILE

_SHIFT = TILE.bit_length() - 1
"""Bits by which a row or column is shifted to become that of its tile, because divisions are slow."""
_WITHIN = TILE - 1
"""Bits of a row or column that say where in its tile it lies, because divisions are slow."""


@njit(cache=True, nogil=True)
def cast_returns(
    start_column: float,
    start_row: float,
    ends: NDArray[np.float64],
    mark: int,
    window: tuple[int, int, int, int],
    first_tile: tuple[int, int],
    index: NDArray[np.int32],
    marks: NDArray[np.int32],
    hits: NDArray[np.uint16],
    passes: NDArray[np.uint16],
    used: NDArray[np.int64],
) -> None:
    """Count for each cell whether the returns of a scan hit it or, failing that, passed it: once per scan.

    The start and the ``ends`` (N, 2), column and row, are in cells; the rest is as the module says.
    """
    first_row, until_row, first_column, until_column = window
    for i in range(len(ends)):
        c, r = int(np.floor(ends[i, 0])), int(np.floor(ends[i, 1]))
        if not (first_row <= r < until_row and first_column <= c < until_column):
            continue
        if marks[r - first_row, c - first_column] != mark:
            marks[r - first_row, c - first_column] = mark
            tile_row, tile_column = (r >> _SHIFT) - first_tile[0], (c >> _SHIFT) - first_tile[1]
            tile = index[tile_row, tile_column]
            if tile < 0:
                tile = _use_tile(index, tile_row, tile_column, used)
            hits[tile, r & _WITHIN, c & _WITHIN] += 1
    for i in range(len(ends)):
        _pass(
            *(start_column, start_row, ends[i], mark, window, first_tile, index, marks, hits, passes, used),
            0.0,
        )


@njit(cache=True, nogil=True)
def cast_misses(
    start_column: float,
    start_row: float,
    ends: NDArray[np.float64],
    returns: int,
    passes_per_hit: float,
    mark: int,
    window: tuple[int, int, int, int],
    first_tile: tuple[int, int],
    index: NDArray[np.int32],
    marks: NDArray[np.int32],
    hits: NDArray[np.uint16],
    passes: NDArray[np.uint16],
    used: NDArray[np.int64],
) -> None:
    """Count the cells that the misses of a scan, its ends after the ``returns``, pass, but not those it hit.

    A cell that is occupied by the counts, with more than one hit in ``passes_per_hit`` passes, ends a miss.
    The other arguments are those of `cast_returns`.
    """
    first_row, until_row, first_column, until_column = window
    for i in range(returns):
        c, r = int(np.floor(ends[i, 0])), int(np.floor(ends[i, 1]))
        if first_row <= r < until_row and first_column <= c < until_column:
            marks[r - first_row, c - first_column] = mark
    for i in range(returns, len(ends)):
        _pass(
            *(start_column, start_row, ends[i], mark, window, first_tile, index, marks, hits, passes, used),
            passes_per_hit,
        )


@njit(cache=True, nogil=True)
def _pass(
    start_column: float,
    start_row: float,
    end: NDArray[np.float64],
    mark: int,
    window: tuple[int, int, int, int],
    first_tile: tuple[int, int],
    index: NDArray[np.int32],
    marks: NDArray[np.int32],
    hits: NDArray[np.uint16],
    passes: NDArray[np.uint16],
    used: NDArray[np.int64],
    passes_per_hit: float,
) -> None:
    """Count the cells that a beam passes, up to an occupied one, if a hit is worth any passes: Amanatides and
    Woo, "A fast voxel traversal algorithm", 1987."""
    first_row, until_row, first_column, until_column = window
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
                tile_row, tile_column = (r >> _SHIFT) - first_tile[0], (c >> _SHIFT) - first_tile[1]
                tile = index[tile_row, tile_column]
                if tile < 0:
                    tile = _use_tile(index, tile_row, tile_column, used)
                row, column = r & _WITHIN, c & _WITHIN
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
def _use_tile(index: NDArray[np.int32], row: int, column: int, used: NDArray[np.int64]) -> int:
    """Take the next of the counts' tiles into use."""
    index[row, column] = used[0]
    used[0] += 1
    return int(index[row, column])
