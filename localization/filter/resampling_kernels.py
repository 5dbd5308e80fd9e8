"""The loop of systematic resampling."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def systematic_indices(weights: NDArray[np.float64], count: int, offset: float) -> NDArray[np.int64]:
    """Where ``count`` pointers, 1/count apart and the first at ``offset``/count, fall into the weights.

    First counted is how many weights each pointer has passed: two loops without a branch to mispredict.
    """
    passed = np.zeros(count + 1, dtype=np.int64)
    reached = 0.0
    for index in range(len(weights)):
        reached += weights[index] * count
        passed[min(int(reached - offset + 1.0), count)] += 1
    indices = np.empty(count, dtype=np.int64)
    index = 0
    for pointer in range(count):
        index += passed[pointer]
        indices[pointer] = min(index, len(weights) - 1)
    return indices


@njit(cache=True, nogil=True)
def take_rows(
    first: NDArray[np.float64], second: NDArray[np.float64], indices: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The rows of two tables (N, 3) at some indices, without the lock that NumPy keeps for it."""
    first_taken, second_taken = np.empty((len(indices), 3)), np.empty((len(indices), 3))
    for i in range(len(indices)):
        for column in range(3):
            first_taken[i, column] = first[indices[i], column]
            second_taken[i, column] = second[indices[i], column]
    return first_taken, second_taken
