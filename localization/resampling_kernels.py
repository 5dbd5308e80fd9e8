"""The loop of systematic resampling."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def systematic_indices(weights: NDArray[np.float64], count: int, offset: float) -> NDArray[np.int64]:
    """Where ``count`` pointers, 1/count apart and the first at ``offset``/count, fall into the weights."""
    indices = np.empty(count, dtype=np.int64)
    last = len(weights) - 1
    index = 0
    reached = weights[0]
    for i in range(count):
        pointer = (i + offset) / count
        while reached < pointer and index < last:
            index += 1
            reached += weights[index]
        indices[i] = index
    return indices
