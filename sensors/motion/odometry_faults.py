"""What a car's odometry always gets wrong.

Wheels are smaller than the settings of the motor driver say, a servo turns by more, and its middle is not
straight ahead, or two driven wheels differ in size: so distances and turns are off by a factor each, and the
car turns by a trim per metre.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, wrap_angle


@dataclass(frozen=True)
class OdometryFaults:
    """What odometry leaves out."""

    distance: float = 0.0
    turn: float = 0.0
    """Shares of what it reports."""
    trim: float = 0.0
    """Radians per metre by which the car turns left where odometry says straight ahead."""

    def corrected(self, steps: Pose) -> Pose:
        """Measured increments (..., 3) with what was left out."""
        steps = np.asarray(steps, dtype=np.float64)
        corrected: Pose = (1.0 + self.distance) * steps
        corrected[..., 2] = wrap_angle(self.trim * forward(steps) + (1.0 + self.turn) * steps[..., 2])
        return corrected


def forward(steps: Pose) -> NDArray[np.float64]:
    """(...) metres of steps (..., 3), negative backwards."""
    length: NDArray[np.float64] = np.hypot(steps[..., 0], steps[..., 1])
    return np.copysign(length, steps[..., 0])
