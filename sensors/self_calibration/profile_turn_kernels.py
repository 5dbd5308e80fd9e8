"""Compare range profiles at many rotations."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def profile_differences(
    before: NDArray[np.float64],
    after: NDArray[np.float64],
    steps: int,
    max_difference: float,
    min_share: float,
) -> NDArray[np.float64]:
    """(2 steps + 1,) mean difference of two cyclic profiles (B,), clipped at ``max_difference``, with the
    later one shifted by -steps to steps bins. inf where the bins known in both are fewer than ``min_share``
    of the most at any shift."""
    bins = len(before)
    sums, counts = np.zeros(2 * steps + 1), np.zeros(2 * steps + 1)
    for index in range(2 * steps + 1):
        shift = index - steps
        for bin_ in range(bins):
            difference = abs(after[(bin_ - shift) % bins] - before[bin_])
            if difference == difference:  # neither is NaN
                sums[index] += min(difference, max_difference)
                counts[index] += 1.0
    least = max(min_share * counts.max(), 1.0)
    for index in range(2 * steps + 1):
        sums[index] = sums[index] / counts[index] if counts[index] >= least else np.inf
    return sums
