"""The loop over the particles' slips, and what they depend on."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.localization.numerics.noise_kernels import noise
from racecar.maps.geometry.se2 import Pose

_GRIP = 4.0
"""m/s² at which tyres slip as much as they ever do."""


@njit(cache=True, nogil=True)
def tyre_effort(speed: Pose, next_speed: Pose, seconds: float) -> NDArray[np.float64]:
    """(2,) how hard the tyres were pushed along the car and across it, 0 to 1, between two speeds (3,)."""
    effort = np.empty(2)
    effort[0] = min(abs(next_speed[0] - speed[0]) / max(seconds, 1e-3) / _GRIP, 1.0)
    effort[1] = min(abs(next_speed[0] * next_speed[2]) / _GRIP, 1.0)
    return effort


@njit(cache=True, nogil=True)
def change_slips(
    slips: NDArray[np.float64],
    kept: NDArray[np.float64],
    spread: NDArray[np.float64],
    seed: np.uint32,
) -> NDArray[np.float64]:
    """Slips (N, 3) of which shares (3,) are kept and to which noise of deviations (3,) comes."""
    changed = np.empty_like(slips)
    drawn = changed.ravel()
    for number in range(len(drawn)):
        drawn[number] = noise(seed, number)
    for i in range(len(slips)):
        for axis in range(3):
            changed[i, axis] = kept[axis] * slips[i, axis] + spread[axis] * changed[i, axis]
    return changed
