"""What a car's odometry always gets wrong, learned while it drives.

Its three `OdometryFaults` show in how the estimates and odometry differ, segment after segment; a Kalman
filter keeps them (Thrun, Burgard and Fox: Probabilistic Robotics, 2005, section 3.2).
"""

from math import exp

import numpy as np
from numpy.typing import NDArray

from racecar.localization.odometry.config import OdometryCalibrationConfig
from racecar.localization.odometry.segments import OdometrySegment
from racecar.maps.sensing.odometry_faults import OdometryFaults


class OdometryCalibration:
    """Learns the faults."""

    def __init__(self, config: OdometryCalibrationConfig) -> None:
        self.config = config
        self.faults = OdometryFaults()
        """Replaced as a whole, so that any thread may read them."""
        self._mean, self._covariance = np.zeros(3), np.diag(self._usual**2)

    def learn(self, segment: OdometrySegment, slip: float) -> None:
        """Take in how a segment of corrected odometry was off, whose tyres slip so much when pushed."""
        kept = exp(-segment.travel / self.config.memory)
        mean = kept * self._mean
        covariance = kept**2 * self._covariance + (1.0 - kept**2) * np.diag(self._usual**2)
        error = segment.error - segment.by_faults @ (mean - self._mean)
        noise = _noise(segment, slip, self.config.unexplained)
        expected = segment.by_faults @ covariance @ segment.by_faults.T + noise
        if error @ np.linalg.solve(expected, error) > self.config.farthest:
            return
        gain = np.linalg.solve(expected, segment.by_faults @ covariance).T
        self._mean, self._covariance = mean + gain @ error, covariance - gain @ expected @ gain.T
        self.faults = OdometryFaults(*self._mean.tolist())

    @property
    def _usual(self) -> NDArray[np.float64]:
        """(3,) standard deviations of the faults of cars."""
        config = self.config
        return np.array([config.distance_deviation, config.turn_deviation, config.trim_deviation])


def _noise(segment: OdometrySegment, slip: float, unexplained: float) -> NDArray[np.float64]:
    """(3, 3) what the end of a segment is off by besides the faults: by estimates, slip and chance."""
    place, heading = segment.begin_variances + segment.end_variances
    along = (slip * segment.pushed_distance) ** 2 + (unexplained * segment.travel) ** 2
    turn = (slip * segment.pushed_turn) ** 2 + (unexplained * segment.travel) ** 2
    # A wrong heading at the beginning carries all of the path aside, a wrong turn half of it on average.
    aside = segment.distance**2 * (segment.begin_variances[1] + 0.25 * turn)
    return np.diag([place + along, place + aside, heading + turn])
