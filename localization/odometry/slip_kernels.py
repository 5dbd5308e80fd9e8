"""Slip: by what share odometry overstates or understates the motion, or reports it too early.

Each particle has a guess of its own and keeps it for a while, so that the filter learns the slip as it learns
the pose. What a car's odometry always gets wrong stays for long; what tyres lose when they are pushed, in
bends and when the speed changes, comes and goes with the force on them. Where odometry is made of what servo
and motor are told to do, or its clock is not the laser's, the car is behind; by how much is its own, too.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.localization.numerics.noise_kernels import noise, random_seed
from racecar.localization.odometry.config import SlipConfig


def changed_slips(
    slips: NDArray[np.float64],
    seconds: float,
    effort: NDArray[np.float64],
    most: NDArray[np.float64],
    config: SlipConfig,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Slips (N, 3) of distance, turn and lag after some time; after an infinite one nothing is left of these.

    At full effort (2,), along and across the car, the deviations of the first two are ``most`` (2,).
    """
    lasting = np.array([config.distance_seconds, config.turn_seconds, config.lag_seconds])
    pushed = np.append(effort, 0.0)  # the lag does not depend on the tyres
    usual = np.append(np.minimum(config.usual_share, most), config.lag_deviation if most.any() else 0.0)
    kept = np.exp(-seconds * (1.0 / lasting + pushed / config.pushed_seconds))
    deviations = np.hypot(usual, np.append(most, 0.0) * pushed)
    return _blend(slips, kept, deviations * np.sqrt(1.0 - kept**2), random_seed(rng))


@njit(cache=True, nogil=True)
def _blend(
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
