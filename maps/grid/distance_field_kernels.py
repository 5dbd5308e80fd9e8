"""The exact distance transform, in the memory of its result.

A. Meijster, J. B. T. M. Roerdink, W. H. Hesselink: A general algorithm for computing distance transforms in
linear time, Mathematical Morphology and its Applications, 2000. SciPy's takes 24 bytes more for each cell.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def fill_distances(is_source: NDArray[np.bool_], spacing: float, distances: NDArray[np.float32]) -> None:
    """Fill distances (rows, columns) from each cell's centre to that of the nearest source, of which there is
    at least one; cells lie ``spacing`` apart."""
    rows, columns = is_source.shape
    beyond = rows + columns
    for row in range(rows):  # first the cells to the nearest source of the same column, of which 32 bits
        for column in range(columns):  # of a float hold 16 million exactly
            if is_source[row, column]:
                distances[row, column] = 0
            elif row == 0:
                distances[row, column] = beyond
            else:
                distances[row, column] = min(distances[row - 1, column] + 1, beyond)
    for row in range(rows - 2, -1, -1):
        for column in range(columns):
            below = distances[row + 1, column] + 1
            if below < distances[row, column]:
                distances[row, column] = below
    heights = np.empty(columns, dtype=np.int64)
    nearest = np.empty(columns, dtype=np.int64)
    since = np.empty(columns, dtype=np.int64)
    for row in range(rows):
        for column in range(columns):
            heights[column] = np.int64(distances[row, column])
        last = _lower_envelope(heights, nearest, since)
        for column in range(columns - 1, -1, -1):
            along, across = spacing * (nearest[last] - column), spacing * heights[nearest[last]]
            distances[row, column] = math.sqrt(across * across + along * along)
            if column == since[last]:
                last -= 1


@njit(cache=True, nogil=True)
def _lower_envelope(heights: NDArray[np.int64], nearest: NDArray[np.int64], since: NDArray[np.int64]) -> int:
    """Which column's parabola is the lowest, ``nearest[k]`` from column ``since[k]`` on; the last k."""
    last = 0
    nearest[0] = since[0] = 0
    for column in range(1, len(heights)):
        height = heights[column] ** 2
        while last >= 0:
            start, best = since[last], nearest[last]
            if (start - best) ** 2 + heights[best] ** 2 <= (start - column) ** 2 + height:
                break
            last -= 1
        if last < 0:
            last = 0
            nearest[0] = column
            continue
        best = nearest[last]
        first = 1 + (column**2 - best**2 + height - heights[best] ** 2) // (2 * (column - best))
        if first < len(heights):
            last += 1
            nearest[last] = column
            since[last] = first
    return last
