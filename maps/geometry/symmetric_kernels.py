"""Symmetric three by three matrices, written out: NumPy's linear algebra takes seconds to compile."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def inverse_of_symmetric(symmetric: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, 3) from the upper triangle of a symmetric matrix (3, 3), by its cofactors."""
    a, b, c = symmetric[0, 0], symmetric[0, 1], symmetric[0, 2]
    d, e, f = symmetric[1, 1], symmetric[1, 2], symmetric[2, 2]
    inverse = np.empty((3, 3))
    inverse[0, 0], inverse[0, 1], inverse[0, 2] = d * f - e * e, c * e - b * f, b * e - c * d
    inverse[1, 1], inverse[1, 2], inverse[2, 2] = a * f - c * c, b * c - a * e, a * d - b * b
    determinant = a * inverse[0, 0] + b * inverse[0, 1] + c * inverse[0, 2]
    for i in range(3):
        for j in range(i, 3):
            inverse[i, j] /= determinant
            inverse[j, i] = inverse[i, j]
    return inverse
