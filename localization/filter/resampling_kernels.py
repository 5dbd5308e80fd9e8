"""Drawing the likely particles again and leaving the unlikely ones out."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


def systematic_resample(
    weights: NDArray[np.float64], count: int, rng: np.random.Generator
) -> NDArray[np.int64]:
    """Indices (count,) into weights (N,) that sum to 1, ascending.

    One random number for all (low variance): a particle of weight w is taken floor or ceil of w·count times.
    """
    indices: NDArray[np.int64] = _systematic_indices(weights, count, rng.random())
    return indices


@njit(cache=True, nogil=True)
def _systematic_indices(weights: NDArray[np.float64], count: int, offset: float) -> NDArray[np.int64]:
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
    """The rows of two tables (N, 3) at some indices; unlike NumPy it lets go of the GIL meanwhile."""
    first_taken, second_taken = np.empty((len(indices), 3)), np.empty((len(indices), 3))
    for i in range(len(indices)):
        for column in range(3):
            first_taken[i, column] = first[indices[i], column]
            second_taken[i, column] = second[indices[i], column]
    return first_taken, second_taken
