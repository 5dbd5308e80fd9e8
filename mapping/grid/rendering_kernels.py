"""Ray casting of scans into a grid: the inner loop."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def cast_scan(
    start_column: float,
    start_row: float,
    ends: NDArray[np.float64],
    is_hit: NDArray[np.bool_],
    mark: int,
    marks: NDArray[np.int32],
    hits: NDArray[np.uint16],
    passes: NDArray[np.uint16],
) -> None:
    """Count for each cell whether this scan hit it or, failing that, passed it: once per scan.

    The start and the ``ends`` (N, 2), column and row, are in cells; ``marks`` remembers the last scan,
    ``mark``, that touched a cell. Grid traversal after Amanatides and Woo, "A fast voxel traversal
    algorithm", 1987.
    """
    rows, columns = hits.shape
    for i in range(len(ends)):
        c, r = int(np.floor(ends[i, 0])), int(np.floor(ends[i, 1]))
        if is_hit[i] and 0 <= r < rows and 0 <= c < columns and marks[r, c] != mark:
            marks[r, c] = mark
            hits[r, c] += 1
    for i in range(len(ends)):
        dx, dy = ends[i, 0] - start_column, ends[i, 1] - start_row
        c, r = int(np.floor(start_column)), int(np.floor(start_row))
        last_c, last_r = int(np.floor(ends[i, 0])), int(np.floor(ends[i, 1]))
        step_c = 1 if dx > 0 else -1
        step_r = 1 if dy > 0 else -1
        delta_c = abs(1.0 / dx) if dx != 0.0 else np.inf
        delta_r = abs(1.0 / dy) if dy != 0.0 else np.inf
        next_c = ((c + 1 - start_column) if dx > 0 else (start_column - c)) * delta_c if dx != 0.0 else np.inf
        next_r = ((r + 1 - start_row) if dy > 0 else (start_row - r)) * delta_r if dy != 0.0 else np.inf
        for _ in range(abs(last_c - c) + abs(last_r - r)):
            if 0 <= r < rows and 0 <= c < columns and marks[r, c] != mark:
                marks[r, c] = mark
                passes[r, c] += 1
            if next_c < next_r:
                next_c += delta_c
                c += step_c
            else:
                next_r += delta_r
                r += step_r
