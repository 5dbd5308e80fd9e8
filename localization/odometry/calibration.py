"""What a car's odometry always gets wrong, learned while it drives.

Wheels are smaller than the settings of the motor driver say, a servo turns by more, and its middle is not
straight ahead: so way and turn are off by a factor each, and the car turns by a trim per metre. These three
faults are what the estimates and odometry differ by, stretch after stretch; a Kalman filter keeps them
(Thrun, Burgard and Fox: Probabilistic Robotics, 2005, section 3.2).
"""

from dataclasses import dataclass
from math import exp

import numpy as np
from numpy.typing import NDArray

from racecar.localization.odometry.segments import OdometryStretch
from racecar.maps.geometry.se2 import Pose

_USUAL = np.array([0.1, 0.1, 0.05])
"""Standard deviations of the faults of cars: shares of way and turn, and radians per metre."""
_MEMORY = 200.0
"""Metres plus radians after which a third is left of what was learned."""
_UNEXPLAINED = 0.05
"""Share of way and turn by which a stretch is off for reasons of its own, besides what tyres slip."""
_FARTHEST = 16.0
"""Squared deviations; a stretch beyond tells of a bump, or of a wrong estimate."""


@dataclass(frozen=True)
class OdometryFaults:
    """What odometry leaves out."""

    way: float = 0.0
    turn: float = 0.0
    """Shares of what it tells."""
    trim: float = 0.0
    """Radians per metre by which the car turns left where odometry says straight ahead."""

    def corrected(self, base_from_next_base: Pose) -> Pose:
        """A measured increment (3,) with what was left out."""
        x, y, turn = base_from_next_base.tolist()
        way = 1.0 + self.way
        return np.array([way * x, way * y, (1.0 + self.turn) * turn + self.trim * x])


class OdometryCalibration:
    """Learns the faults."""

    def __init__(self) -> None:
        self.faults = OdometryFaults()
        """Replaced as a whole, so that any thread may read them."""
        self._mean, self._covariance = np.zeros(3), np.diag(_USUAL**2)

    def learn(self, stretch: OdometryStretch, slip: float) -> None:
        """Take in how a stretch of corrected odometry was off, whose tyres slip so much when pushed."""
        kept = exp(-stretch.way / _MEMORY)
        mean = kept * self._mean
        covariance = kept**2 * self._covariance + (1.0 - kept**2) * np.diag(_USUAL**2)
        error = stretch.error - stretch.by_faults @ (mean - self._mean)
        expected = stretch.by_faults @ covariance @ stretch.by_faults.T + _noise(stretch, slip)
        if error @ np.linalg.solve(expected, error) > _FARTHEST:
            return
        gain = np.linalg.solve(expected, stretch.by_faults @ covariance).T
        self._mean, self._covariance = mean + gain @ error, covariance - gain @ expected @ gain.T
        self.faults = OdometryFaults(*self._mean.tolist())


def _noise(stretch: OdometryStretch, slip: float) -> NDArray[np.float64]:
    """(3, 3) what the end of a stretch is off by besides the faults: by estimates, slip and chance."""
    place, heading = stretch.begin_variances + stretch.end_variances
    along = (slip * stretch.pushed_path) ** 2 + (_UNEXPLAINED * stretch.way) ** 2
    turn = (slip * stretch.pushed_turn) ** 2 + (_UNEXPLAINED * stretch.way) ** 2
    # A wrong heading at the beginning carries all of the path aside, a wrong turn half of it on average.
    aside = stretch.path**2 * (stretch.begin_variances[1] + 0.25 * turn)
    return np.diag([place + along, place + aside, heading + turn])
