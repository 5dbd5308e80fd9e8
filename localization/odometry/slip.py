"""Slip: by what share odometry overstates or understates the motion, or tells it too early.

Each particle has a guess of its own and keeps it for a while, so that the filter learns the slip as it learns
the pose. What a car's odometry always gets wrong stays for long; what tyres lose when they are pushed, in
bends and when the speed changes, comes and goes with the force on them. Where odometry is made of what servo
and motor are told to do, or its clock is not the laser's, the car is behind; by how much is its own, too.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.localization.numerics.noise_kernels import random_seed
from racecar.localization.odometry.slip_kernels import change_slips

_USUAL = 0.05
_LAG = 0.7
"""Standard deviations of the share that odometry is wrong by anyway, and of that by which a car is behind as
a step has it; two race cars were seen to have 1.6."""
_SECONDS = np.array([10.0, 10.0, 30.0])
"""How long way, turn and lag stay the same."""
_PUSHED_SECONDS = 0.5


def changed_slips(
    slips: NDArray[np.float64],
    seconds: float,
    effort: NDArray[np.float64],
    most: NDArray[np.float64],
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Slips (N, 3) of way, turn and lag after some time; after an infinite one nothing is left of these.

    At full effort (2,), along and across the car, the deviations of the first two are ``most`` (2,).
    """
    pushed = np.append(effort, 0.0)  # the lag does not depend on the tyres
    usual = np.append(np.minimum(_USUAL, most), _LAG if most.any() else 0.0)
    kept = np.exp(-seconds * (1.0 / _SECONDS + pushed / _PUSHED_SECONDS))
    deviations = np.hypot(usual, np.append(most, 0.0) * pushed)
    return change_slips(slips, kept, deviations * np.sqrt(1.0 - kept**2), random_seed(rng))
