"""Walks along the rays of a scan over a coarse grid."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def look(touched: NDArray[np.float64], seen: NDArray[np.bool_]) -> int:
    """How many cells (rows, columns) a scan touches that were not ``seen``; now they are.

    ``touched`` (N + 1, 2), column and row in fractions of cells, are the ends of its rays and their start.
    Rays are followed in steps of half a cell at most, so that few cells are missed that they cut at a corner.
    """
    column, row = touched[-1]
    unseen = 0
    for i in range(len(touched)):
        dx, dy = touched[i, 0] - column, touched[i, 1] - row
        steps = int(2.0 * max(abs(dx), abs(dy))) + 1
        for step in range(steps + 1):
            share = step / steps
            r, c = int(row + share * dy), int(column + share * dx)
            if not seen[r, c]:
                seen[r, c] = True
                unseen += 1
    return unseen
