"""Slip: by what share wheels and steering overstate or understate the motion.

Each particle has a guess of its own and keeps it for a while, so that the filter learns the slip as it learns
the pose. What a car's odometry always gets wrong stays for long; what tyres lose when they are pushed, in
bends and when the speed changes, comes and goes with the force on them.
"""

import numpy as np
from numpy.typing import NDArray

from localization.noise_kernels import random_words
from localization.slip_kernels import change_slips
from maps.se2 import Pose

_USUAL = 0.05
_USUAL_SECONDS = 10.0
"""Standard deviation of the share that odometry is wrong by anyway, and for how long it stays the same."""
_PUSHED_SECONDS = 0.5
_GRIP = 4.0
"""m/s² at which tyres slip as much as they ever do."""


def tyre_effort(speed: Pose, next_speed: Pose, seconds: float) -> NDArray[np.float64]:
    """(2,) how hard the tyres were pushed along the car and across it, 0 to 1, between two speeds (3,)."""
    along = abs(next_speed[0] - speed[0]) / max(seconds, 1e-3)
    across = abs(next_speed[0] * next_speed[2])
    return np.minimum(np.array([along, across]) / _GRIP, 1.0)


def changed_slips(
    slips: NDArray[np.float64],
    seconds: float,
    effort: NDArray[np.float64],
    most: float,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Slips (N, 2) of way and turn some time later; ``most`` is their deviation at full effort (2,)."""
    kept = np.exp(-seconds * (1.0 / _USUAL_SECONDS + effort / _PUSHED_SECONDS))
    deviation = np.hypot(min(_USUAL, most), most * effort)
    return change_slips(slips, kept, deviation * np.sqrt(1.0 - kept**2), random_words(slips.shape, rng))
