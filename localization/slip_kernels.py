"""The loop over the particles' slips."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from localization.noise_kernels import deviate


@njit(cache=True, nogil=True)
def change_slips(
    slips: NDArray[np.float64],
    kept: NDArray[np.float64],
    spread: NDArray[np.float64],
    words: NDArray[np.uint64],
) -> NDArray[np.float64]:
    """Slips (N, 3) of which shares (3,) are kept and to which noise of deviations (3,) comes."""
    changed = np.empty_like(slips)
    for i in range(len(slips)):
        for axis in range(3):
            changed[i, axis] = kept[axis] * slips[i, axis] + spread[axis] * deviate(words[i, axis])
    return changed
