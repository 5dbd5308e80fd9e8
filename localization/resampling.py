"""Drawing the likely particles again and leaving the unlikely ones out."""

import numpy as np
from numpy.typing import NDArray

from localization.resampling_kernels import systematic_indices


def effective_sample_size(weights: NDArray[np.float64]) -> float:
    """How many equally weighted particles weights (N,) that sum to 1 are worth, 1 to N."""
    return float(1.0 / np.dot(weights, weights))


def systematic_resample(
    weights: NDArray[np.float64], count: int, rng: np.random.Generator
) -> NDArray[np.int64]:
    """Indices (count,) into weights (N,) that sum to 1, ascending.

    One random number for all (low variance): a particle of weight w is taken floor or ceil of w·count times.
    """
    indices: NDArray[np.int64] = systematic_indices(weights, count, rng.random())
    return indices
