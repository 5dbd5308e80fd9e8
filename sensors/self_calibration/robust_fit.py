"""Linear least squares, robust to outliers, with a covariance.

Cauchy weights, by iterative reweighting, suppress slipping wheels and badly tracked scans. Windows within a
block of time overlap and have correlated errors, so the covariance is the sandwich estimate over blocks
[Liang and Zeger, "Longitudinal data analysis using generalized linear models", Biometrika 73, 1986].
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

BLOCK = 1_000_000_000
"""Nanoseconds of a block. Chosen by judgement: as long as a window."""
MIN_BLOCKS = 6
"""Minimum number of blocks for a decision, since fewer do not show their spread."""
SIGMAS = 3.0
"""Standard deviations of a significant result, because that is usual."""

_ROUNDS = 10
"""Iterations of reweighting, since weights hardly change after a few."""


@dataclass(frozen=True, eq=False)
class RobustFit:
    """Estimate of N unknowns."""

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
    """Solve equations (W, M, N) for targets (W, M), M in each of W windows that belong to blocks (W,).

    Targets have at least this ``noise``; the ``prior`` (N, N) is information that the unknowns are near zero,
    in units of the noise.
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
    """Mean of values (W,) that belong to blocks (W,), and its standard deviation, estimated likewise."""
    _, block = np.unique(blocks, return_inverse=True)
    mean = float(values.mean())
    return mean, float(np.linalg.norm(np.bincount(block, values - mean))) / len(values)


def blocks_at(stamps: NDArray[np.int64]) -> NDArray[np.int64]:
    """(W,) block indices of stamps (W,) in nanoseconds."""
    return stamps // BLOCK
