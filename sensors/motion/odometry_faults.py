"""Systematic errors of a car's odometry.

The wheels are smaller than configured in the motor driver, a servo turns further and its centre is not
straight ahead, or two driven wheels differ in size. So distances and turns each have a scale error, and the
car turns by a trim per metre.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, wrap_angle


@dataclass(frozen=True)
class OdometryFaults:
    """Motion missing from the odometry."""

    distance: float = 0.0
    turn: float = 0.0
    """Relative to the reported distance and turn."""
    trim: float = 0.0
    """Radians per metre by which the car turns left while odometry reports straight ahead."""

    def corrected(self, steps: Pose) -> Pose:
        """Measured increments (..., 3) with the missing motion added."""
        steps = np.asarray(steps, dtype=np.float64)
        corrected: Pose = (1.0 + self.distance) * steps
        corrected[..., 2] = wrap_angle(self.trim * forward(steps) + (1.0 + self.turn) * steps[..., 2])
        return corrected


def forward(steps: Pose) -> NDArray[np.float64]:
    """Forward metres (...) of steps (..., 3), negative backwards."""
    length: NDArray[np.float64] = np.hypot(steps[..., 0], steps[..., 1])
    return np.copysign(length, steps[..., 0])
