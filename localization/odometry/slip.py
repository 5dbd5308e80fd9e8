"""Slip: by what share odometry overstates or understates the motion, or reports it too early.

Each particle has a guess of its own and keeps it for a while, so that the filter learns the slip as it learns
the pose. What a car's odometry always gets wrong stays for long; what tyres lose when they are pushed, in
bends and when the speed changes, comes and goes with the force on them. Where odometry is made of what servo
and motor are told to do, or its clock is not the laser's, the car is behind; by how much is its own, too.
"""

import numpy as np
from numpy.typing import NDArray

CHANGE_AFTER = 0.1
"""Seconds between changes of the slips, so that most steps need none: short beside all times below."""
_USUAL_SHARE = 0.05
"""Standard deviation of the share by which odometry is wrong even when nothing pushes the tyres. Measured:
session_A's distances are 2 to 5 % off."""
_LAG_DEVIATION = 0.7
"""Standard deviation of the car's lag, in units of the usual lag, see `speed_memory`. Measured: two
recorded race cars had 1.6."""
_LASTING = (10.0, 10.0, 30.0)
"""Seconds for which the shares of distance and turn last, and the lag, which lasts longer because it belongs
to the car, not to the floor. By judgement."""
_PUSHED_SECONDS = 0.5
"""For which slips last at full effort: by judgement, since a bend or a braking takes about as long."""


def changed_slips(
    slips: NDArray[np.float64],
    seconds: float,
    effort: NDArray[np.float64],
    most: NDArray[np.float64],
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Slips (N, 3) of distance, turn and lag after some time; after an infinite one nothing is left of these.

    At full effort (2,), along and across the car, the deviations of the first two are ``most`` (2,).
    """
    pushed = np.append(effort, 0.0)  # the lag does not depend on the tyres
    usual = np.append(np.minimum(_USUAL_SHARE, most), _LAG_DEVIATION if most.any() else 0.0)
    kept = np.exp(-seconds * (1.0 / np.array(_LASTING) + pushed / _PUSHED_SECONDS))
    deviations = np.hypot(usual, np.append(most, 0.0) * pushed)
    noise = rng.standard_normal(slips.shape)
    return np.asarray(kept * slips + deviations * np.sqrt(1.0 - kept**2) * noise)
