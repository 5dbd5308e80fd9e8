"""A linear fit that outliers do not bend, and how far it may be off.

Cauchy weights, found by reweighting, keep wheels that slip and scans that were followed wrongly from
deciding. Windows of one block of time overlap and err together, so the covariance is the sandwich estimate
over blocks [Liang and Zeger, "Longitudinal data analysis using generalized linear models", Biometrika 73,
1986].
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

BLOCK = 1_000_000_000
"""Nanoseconds of a block; by judgement: as long as a window."""
MIN_BLOCKS = 6
"""Blocks below which nothing is decided, since their spread is not known from fewer."""
SIGMAS = 3.0
"""Standard deviations by which something is surely so, because that is usual."""

_ROUNDS = 10
"""Of reweighting, since the weights hardly change after a few."""


@dataclass(frozen=True, eq=False)
class RobustFit:
    """N unknowns."""

    solution: NDArray[np.float64]
    """(N,)"""
    covariance: NDArray[np.float64]
    """(N, N)"""


def robust_fit(
    equations: NDArray[np.float64],
    targets: NDArray[np.float64],
    blocks: NDArray[np.int64],
    *,
    noise: float,
    prior: NDArray[np.float64],
) -> RobustFit:
    """Of equations (W, M, N) with targets (W, M), M of them in each of W windows that belong to blocks (W,).

    The targets are never taken to be better than their ``noise``; the ``prior`` (N, N) is information about
    unknowns near zero, in units of that noise.
    """
    weights = np.ones(len(targets))
    for _ in range(_ROUNDS):
        weighted = equations * weights[:, None, None]
        information = np.einsum("wij,wik->jk", weighted, equations) + prior
        solution = np.linalg.solve(information, np.einsum("wij,wi->j", weighted, targets))
        left = targets - equations @ solution
        missed = np.linalg.norm(left, axis=1)
        scale = max(float(np.median(missed)), noise)
        weights = 1.0 / (1.0 + (missed / (2.0 * scale)) ** 2)
    _, block = np.unique(blocks, return_inverse=True)
    pulls = np.zeros((int(block.max()) + 1, len(solution)))
    np.add.at(pulls, block, np.einsum("wij,wi->wj", weighted, left))
    inverse = np.linalg.inv(information)
    return RobustFit(solution, inverse @ (scale**2 * prior + pulls.T @ pulls) @ inverse)


def mean_over_blocks(values: NDArray[np.float64], blocks: NDArray[np.int64]) -> tuple[float, float]:
    """Of values (W,) that belong to blocks (W,), and its standard deviation, in the same way."""
    _, block = np.unique(blocks, return_inverse=True)
    mean = float(values.mean())
    return mean, float(np.linalg.norm(np.bincount(block, values - mean))) / len(values)


def blocks_at(stamps: NDArray[np.int64]) -> NDArray[np.int64]:
    """(W,) the block of time that each of stamps (W,), nanoseconds, is in."""
    return stamps // BLOCK
