"""Learns the systematic errors of a car's odometry and the orientation of its laser while driving.

The three `OdometryFaults` show in the differences between estimates and odometry, segment by segment. So does
a laser that is rotated from its configured mount: the car then seems to drift sideways on straights as well
as in bends, while a slipping car does so in bends only. A Kalman filter estimates all of them (Thrun, Burgard
and Fox: Probabilistic Robotics, 2005, section 3.2).
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
"""Index of the laser's rotation in the state, by definition of `OdometrySegment.by_faults`."""
_MOST = np.array([0.4, 0.4, 0.2, 0.2, 0.2])
"""Bound on each fault, in its unit. Chosen by judgement: far more than any car showed; beyond that it is the
estimates that are wrong."""
_USUAL = np.array([0.05, 0.1, 0.05, 0.03, 0.05])
"""Standard deviations among cars, in the order of `OdometrySegment.by_faults`. Relative error of distances:
recorded cars had 5 %; with more, estimates that drift along a bare corridor implied wheels that report twice
the distance. Relative error of turns: 2 to 5 % in the logs of the SLAM benchmark. Radians per metre by which
cars turn while odometry reports straight ahead: up to 0.06 on those logs. Radians by which lasers are
rotated: two degrees, since brackets are mounted by eye. Metres of slip to the left per metre of path at full
effort: three degrees, since tyres at the limit of grip slip a little."""
_MEMORY = 200.0
"""Metres plus radians after which the learned values decay to a third. Chosen by judgement."""
_UNEXPLAINED = 0.05
"""Share of distance and turn by which a segment is off for other reasons than slipping tyres. Chosen by
judgement."""
_FARTHEST = 16.0
"""Squared Mahalanobis distance above which a segment is rejected, as after a bump. Chosen by judgement: four
standard deviations."""
_CONTRADICTED = 0.4
"""Share of its length by which a rejected segment must be off to be reported. Measured: 0.5 to 1 where
odometry reported half the motion for a second, 0.3 after a kidnapping, at most 0.1 on recordings and drives
without such faults."""
_TURNED_FROM, _SURELY = 0.01, 3.0
"""Radians, and standard deviations in excess of them, above which a laser counts as rotated, since a map, a
floor or the timing of sweeps may mimic less. Measured: on correct mounts up to 0.004 was learned, slipping at
6 and 8 m/s; on sick_hall's, on a map made with it, 0.024 with a deviation of 0.0075 for a while."""


class OdometryCalibration:
    """Learns the systematic errors."""

    def __init__(self) -> None:
        self.faults = OdometryFaults()
        """Replaced as a whole, so that any thread may read them."""
        self.laser_turn = 0.0
        """Radians by which the laser is rotated to the left of its configured mount; 0 unless significant."""
        self.contradicted = 0.0
        """Metres plus radians of segments that were rejected and far off."""
        self._mean, self._covariance = np.zeros(5), np.diag(_USUAL**2)
        self._told: Pose | None = None
        """Configured mount of the laser of the latest scan."""

    def learn(self, segment: OdometrySegment, slip: float) -> None:
        """Update with a segment of corrected odometry; ``slip`` is that of the tyres at full effort."""
        kept = np.full(5, exp(-segment.travel / _MEMORY))
        kept[_LASER] = 1.0  # the laser is not rotated during a drive
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
        """The scan with the learned rotation, which applies to the first laser at one configured mount."""
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
        """A sentence for the user on odometry that suddenly reported another motion; None if it did not."""
        if self.contradicted == 0.0:
            return None
        return (
            f"For at least {self.contradicted:.0f} m the odometry suddenly told another motion than the "
            "scans show, as where wheels spin or its driver falters; poses may lag there. Make sure "
            "that the wheels grip and that no message of the odometry is lost."
        )

    @property
    def laser_warning(self) -> str | None:
        """A sentence for the user on a rotated laser; None if it is not rotated."""
        if self.laser_turn == 0.0:
            return None
        return (
            f"The laser is turned by {abs(degrees(self.laser_turn)):.0f}° to the "
            f"{'left' if self.laser_turn > 0.0 else 'right'} against its transform to the base, as straight "
            "drives show; the localizer corrects that. To remedy it, correct the transform or turn the laser."
        )


def _noise(segment: OdometrySegment, slip: float) -> NDArray[np.float64]:
    """(3, 3) covariance of a segment's end besides faults and estimates: slip and random errors."""
    along, turn = (slip * segment.pushed) ** 2 + (_UNEXPLAINED * segment.travel) ** 2
    # A wrong turn shifts half of the path sideways on average, or a third of its square at random.
    forward = segment.by_faults[2, 2]
    aside, together = segment.driven[0] ** 2 * turn / 3.0, 0.5 * forward * turn
    return np.array([[along, 0.0, 0.0], [0.0, aside, together], [0.0, together, turn]])
