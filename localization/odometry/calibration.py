"""What a car's odometry always gets wrong, and how its laser is turned, learned while it drives.

The three `OdometryFaults` show in how the estimates and odometry differ, segment after segment, and so does a
laser that is turned against its told place: the car then seems to drive aside, on straights as in bends,
while one that slips does so in bends only. A Kalman filter keeps all of it (Thrun, Burgard and Fox:
Probabilistic Robotics, 2005, section 3.2).
"""

from dataclasses import replace
from math import degrees, exp, sqrt

import numpy as np
from numpy.typing import NDArray

from racecar.localization.odometry.config import OdometryCalibrationConfig
from racecar.localization.odometry.segments import OdometrySegment
from racecar.maps.geometry.se2 import Pose
from racecar.maps.sensing.odometry_faults import OdometryFaults
from racecar.maps.sensing.scan import Scan

_LASER = 3
"""Which of what is learned the turn of the laser is, by definition of `OdometrySegment.by_faults`."""
_MOST = np.array([0.4, 0.4, 0.2, 0.2, 0.2])
"""Of each fault, in its unit, far beyond what cars showed, since where more seems wrong the estimates are.
By judgement."""
_LASER_DEVIATION = 0.03
"""Radians, the standard deviation of how lasers are turned against their told place: two degrees, since
brackets are mounted by eye."""
_SIDE_SLIP_DEVIATION = 0.05
"""Metres to the left for each along the path at full effort, the same of side slip: three degrees, since
tyres that grip no more slip by some. By judgement."""
_TURNED_FROM, _SURELY = 0.01, 3.0
"""Radians, and standard deviations, from which on a laser counts as turned, since less may be feigned by a
map or the timing of sweeps. Measured: with right mounts, slipping at 6 and 8 m/s, up to 0.004 was learned."""


class OdometryCalibration:
    """Learns the faults."""

    def __init__(self, config: OdometryCalibrationConfig) -> None:
        self.config = config
        self.faults = OdometryFaults()
        """Replaced as a whole, so that any thread may read them."""
        self.laser_turn = 0.0
        """Radians by which the laser is turned to the left of its told place; 0 unless that is sure."""
        self._mean, self._covariance = np.zeros(5), np.diag(self._usual**2)
        self._told: Pose | None = None
        """Where the laser of the latest scan is said to be on the car."""

    def learn(self, segment: OdometrySegment, slip: float) -> None:
        """Take in how a segment of corrected odometry was off, whose tyres slip so much when pushed."""
        kept = np.full(5, exp(-segment.travel / self.config.memory))
        kept[_LASER] = 1.0  # nobody turns it on the way
        mean = kept * self._mean
        covariance = np.outer(kept, kept) * self._covariance + np.diag((1.0 - kept**2) * self._usual**2)
        error = segment.error - segment.by_faults @ (mean - self._corrected)
        noise = segment.covariance + _noise(segment, slip, self.config.unexplained)
        expected = segment.by_faults @ covariance @ segment.by_faults.T + noise
        if error @ np.linalg.solve(expected, error) > self.config.farthest:
            return
        gain = np.linalg.solve(expected, segment.by_faults @ covariance).T
        self._mean = np.clip(mean + gain @ error, -_MOST, _MOST)
        self._covariance = covariance - gain @ expected @ gain.T
        distance, turn, trim, laser_turn, _ = self._mean.tolist()
        self.faults = OdometryFaults(distance, turn, trim)
        is_turned = abs(laser_turn) > max(_TURNED_FROM, _SURELY * sqrt(self._covariance[_LASER, _LASER]))
        self.laser_turn = laser_turn if is_turned else 0.0

    def turned(self, scan: Scan) -> Scan:
        """A scan as from where its laser is. What was learned belongs to the laser at one told place."""
        if self._told is not None and not np.array_equal(scan.base_from_laser, self._told):
            self.laser_turn = self._mean[_LASER] = 0.0
            self._covariance[_LASER] = self._covariance[:, _LASER] = 0.0
            self._covariance[_LASER, _LASER] = _LASER_DEVIATION**2
        self._told = scan.base_from_laser
        if self.laser_turn == 0.0:
            return scan
        return replace(scan, base_from_laser=self._told + np.array([0.0, 0.0, self.laser_turn]))

    @property
    def laser_warning(self) -> str | None:
        """A sentence for people on a laser that is turned; None where it is not."""
        if self.laser_turn == 0.0:
            return None
        return (
            f"The laser is turned by {abs(degrees(self.laser_turn)):.0f}° to the "
            f"{'left' if self.laser_turn > 0.0 else 'right'} against its transform to the base, as straight "
            "drives show; the localizer corrects that. To remedy it, correct the transform or turn the laser."
        )

    @property
    def _corrected(self) -> NDArray[np.float64]:
        """(5,) of what is learned, that by which the latest segment had been corrected."""
        faults = self.faults
        return np.array([faults.distance, faults.turn, faults.trim, self.laser_turn, 0.0])

    @property
    def _usual(self) -> NDArray[np.float64]:
        """(5,) standard deviations of the faults of cars."""
        config = self.config
        of_odometry = [config.distance_deviation, config.turn_deviation, config.trim_deviation]
        return np.array([*of_odometry, _LASER_DEVIATION, _SIDE_SLIP_DEVIATION])


def _noise(segment: OdometrySegment, slip: float, unexplained: float) -> NDArray[np.float64]:
    """(3, 3) what the end of a segment is off by besides the faults and the estimates: by slip and chance."""
    along = (slip * segment.pushed_distance) ** 2 + (unexplained * segment.travel) ** 2
    turn = (slip * segment.pushed_turn) ** 2 + (unexplained * segment.travel) ** 2
    # A wrong turn carries half of the path aside on average.
    return np.diag([along, 0.25 * segment.distance**2 * turn, turn])
