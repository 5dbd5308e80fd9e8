"""The loop that turns log-likelihoods into weights."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

_HALVINGS = 6
"""Of the argument of the exponential, so that it is at most 50 / 64 and Taylor's series converges fast."""
_EXPONENTIAL = tuple(1.0 / math.factorial(n) for n in reversed(range(12)))
"""Coefficients of the powers in Taylor's series, the highest first: twelve, since the next, 0.8^12 / 12!,
is below 1e-9."""
_LEAST_LOG = -50.0
"""Lower ones are taken for this one, because exp(-50) is nothing beside the best, whose weight is 1."""


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
def take_evidence(
    log_weights: NDArray[np.float64], log_likelihood: NDArray[np.float64], most: float
) -> tuple[NDArray[np.float64], float]:
    """Add a scan's log-likelihoods (N,) to log-weights (N,), the best of which become 0.

    A scan counts by so much at most against any. Returns weights (N,) that sum to 1, and how many equally
    weighted particles they are worth.
    """
    weights = np.empty(len(log_weights))
    best = -math.inf
    for i in range(len(weights)):
        best = max(best, log_likelihood[i])
    heaviest = -math.inf
    for i in range(len(weights)):
        log_weights[i] += max(log_likelihood[i], best - most)
        heaviest = max(heaviest, log_weights[i])
    for i in range(len(weights)):
        log_weights[i] -= heaviest
        weights[i] = _exp(log_weights[i])
    total, squares = 0.0, 0.0
    for i in range(len(weights)):
        total += weights[i]
        squares += weights[i] * weights[i]
    share = 1.0 / total
    for i in range(len(weights)):
        weights[i] *= share
    return weights, total * total / squares


@njit(cache=True, nogil=True, inline="always")
def _exp(log_weight: float) -> float:
    """To 1e-8, of what is at most 0: by Taylor's series on a 64th, squared as often as that was halved.

    A compiler turns it into vector instructions; the library's takes one number at a time.
    """
    x = max(log_weight, _LEAST_LOG) * 0.5**_HALVINGS
    power = 0.0
    for coefficient in _EXPONENTIAL:
        power = power * x + coefficient
    for _ in range(_HALVINGS):
        power *= power
    return power
