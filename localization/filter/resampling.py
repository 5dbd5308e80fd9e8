"""Drawing the likely particles again and leaving the unlikely ones out."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from racecar.localization.filter.resampling_kernels import systematic_indices

_Number = TypeVar("_Number", np.float32, np.float64)


def likelihood_weights(log_likelihood: NDArray[_Number], power: float) -> NDArray[_Number]:
    """(N,) that sum to 1, by the likelihood (N,) to a power."""
    weights: NDArray[_Number] = np.exp(power * (log_likelihood - log_likelihood.max()))
    weights /= weights.sum()
    return weights


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
