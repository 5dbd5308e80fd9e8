"""What a car's odometry always gets wrong, and how its laser is turned, learned while it drives.

The three `OdometryFaults` show in how the estimates and odometry differ, segment after segment, and so does a
laser that is turned against its told place: the car then seems to drive aside, on straights as in bends,
while one that slips does so in bends only. A Kalman filter keeps all of it (Thrun, Burgard and Fox:
Probabilistic Robotics, 2005, section 3.2).
"""

from dataclasses import astuple, replace
from math import degrees, exp, sqrt

import numpy as np
from numpy.typing import NDArray

from racecar.localization.odometry.segments import OdometrySegment
from racecar.maps.geometry.se2 import Pose
from racecar.sensors.motion.odometry_faults import OdometryFaults
from racecar.sensors.scan import Scan

_LASER = 3
"""Which of what is learned the turn of the laser is, by definition of `OdometrySegment.by_faults`."""
_MOST = np.array([0.4, 0.4, 0.2, 0.2, 0.2])
"""Of each fault, in its unit, far beyond what cars showed, since where more seems wrong the estimates are.
By judgement."""
_USUAL = np.array([0.05, 0.1, 0.05, 0.03, 0.05])
"""Standard deviations among cars, in the order of `OdometrySegment.by_faults`. The share by which distances
are off: recorded cars had 5 %, and with more, estimates that wander along a bare corridor made wheels out
that tell twice the distance. The same of turns: 2 to 5 % in the logs of the SLAM benchmark. Radians per metre
by which cars turn where odometry says straight ahead: up to 0.06 on those logs. Radians by which lasers are
turned: two degrees, since brackets are mounted by eye. Metres to the left for each along the path at full
effort: three degrees, since tyres that grip no more slip by some."""
_MEMORY = 200.0
"""By judgement: metres plus radians after which a third is left of what was learned."""
_UNEXPLAINED = 0.05
"""By judgement: share of distance and turn by which a segment is off for reasons of its own, besides slipping
tyres."""
_FARTHEST = 16.0
"""Squared Mahalanobis distance beyond which a segment is left out, as after a bump: by judgement, four
standard deviations."""
_CONTRADICTED = 0.4
"""Share of a segment by which it must be off, too, to be told of. Measured: where odometry told half for a
second it was off by 0.5 to 1, after a kidnapping by 0.3, on recordings and drives without such faults by 0.1
at most."""
_TURNED_FROM, _SURELY = 0.01, 3.0
"""Radians, and standard deviations beyond them, from which on a laser counts as turned, since less may be
feigned by a map, a floor or the timing of sweeps. Measured: of right mounts up to 0.004 was learned, slipping
at 6 and 8 m/s; of sick_hall's, on a map made with it, 0.024 with a deviation of 0.0075 for a while."""


class OdometryCalibration:
    """Learns the faults."""

    def __init__(self) -> None:
        self.faults = OdometryFaults()
        """Replaced as a whole, so that any thread may read them."""
        self.laser_turn = 0.0
        """Radians by which the laser is turned to the left of its told place; 0 unless that is sure."""
        self.contradicted = 0.0
        """Metres plus radians of segments that were left out and off by much."""
        self._mean, self._covariance = np.zeros(5), np.diag(_USUAL**2)
        self._told: Pose | None = None
        """Where the laser of the latest scan is said to be on the car."""

    def learn(self, segment: OdometrySegment, slip: float) -> None:
        """Take in how a segment of corrected odometry was off, whose tyres slip so much when pushed."""
        kept = np.full(5, exp(-segment.travel / _MEMORY))
        kept[_LASER] = 1.0  # nobody turns it on the way
        mean = kept * self._mean
        covariance = np.outer(kept, kept) * self._covariance + np.diag((1.0 - kept**2) * _USUAL**2)
        corrected = np.array([*astuple(self.faults), self.laser_turn, 0.0])
        error = segment.error - segment.by_faults @ (mean - corrected)
        noise = segment.covariance + _noise(segment, slip)
        expected = segment.by_faults @ covariance @ segment.by_faults.T + noise
        if error @ np.linalg.solve(expected, error) > _FARTHEST:
            is_far_off = np.abs(segment.error).max() > _CONTRADICTED * segment.travel
            self.contradicted += segment.travel if is_far_off else 0.0
            return
        gain = np.linalg.solve(expected, segment.by_faults @ covariance).T
        self._mean = np.clip(mean + gain @ error, -_MOST, _MOST)
        self._covariance = covariance - gain @ expected @ gain.T
        distance, turn, trim, laser_turn, _ = self._mean.tolist()
        is_turned = abs(laser_turn) > _TURNED_FROM + _SURELY * sqrt(self._covariance[_LASER, _LASER])
        self.faults = OdometryFaults(distance, turn, trim)
        self.laser_turn = laser_turn if is_turned else 0.0

    def turned(self, scan: Scan) -> Scan:
        """A scan as from where its laser is; what was learned belongs to the first at one told place."""
        if scan.laser != 0:
            return scan
        if self._told is not None and not np.array_equal(scan.base_from_laser, self._told):
            self.laser_turn = self._mean[_LASER] = 0.0
            self._covariance[_LASER] = self._covariance[:, _LASER] = 0.0
            self._covariance[_LASER, _LASER] = _USUAL[_LASER] ** 2
        self._told = scan.base_from_laser
        if self.laser_turn == 0.0:
            return scan
        return replace(scan, base_from_laser=self._told + np.array([0.0, 0.0, self.laser_turn]))

    @property
    def odometry_warning(self) -> str | None:
        """A sentence for people on odometry that suddenly told another motion; None where it did not."""
        if self.contradicted == 0.0:
            return None
        return (
            f"For at least {self.contradicted:.0f} m the odometry suddenly told another motion than the "
            "scans show, as where wheels spin or its driver falters; poses may lag there. Make sure "
            "that the wheels grip and that no message of the odometry is lost."
        )

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


def _noise(segment: OdometrySegment, slip: float) -> NDArray[np.float64]:
    """(3, 3) what the end of a segment is off by besides the faults and the estimates: by slip and chance."""
    along, turn = (slip * segment.pushed) ** 2 + (_UNEXPLAINED * segment.travel) ** 2
    # A wrong turn carries half of the path aside on average, at random a third of its square.
    forward = segment.by_faults[2, 2]
    aside, together = segment.driven[0] ** 2 * turn / 3.0, 0.5 * forward * turn
    return np.array([[along, 0.0, 0.0], [0.0, aside, together], [0.0, together, turn]])
