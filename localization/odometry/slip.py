"""Slip: how much odometry overstates or understates the motion, or reports it too early.

Each particle keeps its own hypothesis for a while, so that the filter learns the slip as it learns the pose.
Systematic errors of the odometry last long. Slip of the tyres under load, in bends and when the speed
changes, follows the force on them. Where odometry is computed from the commands to servo and motor, or its
clock is not the laser's, the car lags behind it, by an amount that also differs between cars.
"""

import numpy as np
from numpy.typing import NDArray

CHANGE_AFTER = 0.1
"""Seconds between updates of the slips, so that most steps need none: short compared with all times below."""
_USUAL_SHARE = 0.05
"""Standard deviation of the relative odometry error even without load on the tyres. Measured: session_A's
distances are 2 to 5 % off."""
_LAG_DEVIATION = 0.7
"""Standard deviation of the car's lag, in units of the usual lag, see `speed_memory`. Measured: two recorded
race cars had 1.6."""
_LASTING = (10.0, 10.0, 30.0)
"""Time constants in seconds of the slip of distance and turn, and of the lag, which lasts longer because it
depends on the car, not on the floor. Chosen by judgement."""
_PUSHED_SECONDS = 0.5
"""Time constant of the slip at full effort. Chosen by judgement: the duration of a bend or of braking."""


def changed_slips(
    slips: NDArray[np.float64],
    seconds: float,
    effort: NDArray[np.float64],
    most: NDArray[np.float64],
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Slips (N, 3) of distance, turn and lag after some time; after an infinite time they are all redrawn.

    At full effort (2,), along and across the car, the deviations of the first two are ``most`` (2,).
    """
    pushed = np.append(effort, 0.0)  # the lag does not depend on the tyres
    usual = np.append(np.minimum(_USUAL_SHARE, most), _LAG_DEVIATION if most.any() else 0.0)
    kept = np.exp(-seconds * (1.0 / np.array(_LASTING) + pushed / _PUSHED_SECONDS))
    deviations = np.hypot(usual, np.append(most, 0.0) * pushed)
    noise = rng.standard_normal(slips.shape)
    return np.asarray(kept * slips + deviations * np.sqrt(1.0 - kept**2) * noise)
