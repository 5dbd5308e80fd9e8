"""Ray casting of scans into a grid: the inner loop."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def cast_returns(
    start_column: float,
    start_row: float,
    ends: NDArray[np.float64],
    mark: int,
    marks: NDArray[np.int32],
    hits: NDArray[np.uint16],
    passes: NDArray[np.uint16],
) -> None:
    """Count for each cell whether the returns of a scan hit it or, failing that, passed it: once per scan.

    The start and the ``ends`` (N, 2), column and row, are in cells; ``marks`` remembers the last scan,
    ``mark``, that touched a cell.
    """
    rows, columns = hits.shape
    for i in range(len(ends)):
        c, r = int(np.floor(ends[i, 0])), int(np.floor(ends[i, 1]))
        if 0 <= r < rows and 0 <= c < columns and marks[r, c] != mark:
            marks[r, c] = mark
            hits[r, c] += 1
    for i in range(len(ends)):
        _pass(start_column, start_row, ends[i], mark, marks, hits, passes, 0.0)


@njit(cache=True, nogil=True)
def cast_misses(
    start_column: float,
    start_row: float,
    ends: NDArray[np.float64],
    returns: int,
    mark: int,
    marks: NDArray[np.int32],
    hits: NDArray[np.uint16],
    passes: NDArray[np.uint16],
    passes_per_hit: float,
) -> None:
    """Count the cells that the misses of a scan, its ends after the ``returns``, pass, but not those it hit.

    A cell that is occupied by the counts, with more than one hit in ``passes_per_hit`` passes, ends a miss.
    The other arguments are those of `cast_returns`.
    """
    rows, columns = hits.shape
    for i in range(returns):
        c, r = int(np.floor(ends[i, 0])), int(np.floor(ends[i, 1]))
        if 0 <= r < rows and 0 <= c < columns:
            marks[r, c] = mark
    for i in range(returns, len(ends)):
        _pass(start_column, start_row, ends[i], mark, marks, hits, passes, passes_per_hit)


@njit(cache=True, nogil=True)
def _pass(
    start_column: float,
    start_row: float,
    end: NDArray[np.float64],
    mark: int,
    marks: NDArray[np.int32],
    hits: NDArray[np.uint16],
    passes: NDArray[np.uint16],
    passes_per_hit: float,
) -> None:
    """Count the cells that a beam passes, up to an occupied one, if a hit is worth any passes: Amanatides and
    Woo, "A fast voxel traversal algorithm", 1987."""
    rows, columns = hits.shape
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
        if 0 <= r < rows and 0 <= c < columns:
            if marks[r, c] != mark:
                marks[r, c] = mark
                passes[r, c] += 1
            if hits[r, c] * passes_per_hit > passes[r, c]:
                return
        if next_c < next_r:
            next_c += delta_c
            c += step_c
        else:
            next_r += delta_r
            r += step_r
