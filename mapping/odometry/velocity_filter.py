"""The laser's motion since the last keyframe where no wheels tell it, by scans and by its velocity.

Along an arc or a bare corridor scans leave the motion nearly open, and registration alone comes to a stand
there. But a car cannot change its velocity much between scans that come often. So a Kalman filter carries it
on, with white noise for its acceleration [Bar-Shalom, Li and Kirubarajan, Estimation with Applications to
Tracking and Navigation, 2001, section 6.2.2]; what it measures is a match of each scan with the last
keyframe, to which the prediction is the prior.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.arrays import Arrays
from racecar.mapping.matching.match_information import as_prior, match_information
from racecar.mapping.matching.scan_matching import Matches, match, one_to_one
from racecar.mapping.matching.scan_store import PreparedScan, ScanStore, prepare_scan
from racecar.mapping.odometry.deskew import by_velocity, deskew
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose, inverse, transform_points
from racecar.maps.sensing.scan import Scan

_LONGEST = 0.25
"""Seconds between two scans, beyond which a velocity tells too little of where the next one is."""
_ACCELERATION = np.diag([3.0, 1.0, 6.0]) ** 2
"""Spectral density: what velocity, in m/s and rad/s, gains in a second, squared."""
_FIRST_VELOCITY = np.diag([2.0, 0.5, 2.0]) ** 2
_FIRST_PLACE = np.diag([0.02, 0.02, 0.02]) ** 2
_ROUNDING = 1e-6 * np.eye(3)
"""Square metres and radians, of each match: it ends where steps are short, not where they are none."""
_LEAST_OVERLAP = 0.2
_INCREDIBLE = 40.0
"""Squared Mahalanobis distance between prediction and match, of three dimensions."""
_SCAN_ODOMETRY = np.diag([0.5, 0.5, 0.25]) ** 2
"""By how much it may miss a step since the keyframe: next to nothing unless scans leave a direction open."""
_TRUSTED_AFTER, _EACH_AFTER = 10.0, 0.05
"""Scans that were followed, of which those that came sooner, in seconds, count for less: where stamps come in
bunches velocities are wrong."""
_NOTHING_SEEN = PreparedScan(np.zeros((0, 2), dtype=np.float32), np.zeros((0, 2), dtype=np.float32))


class VelocityFilter:
    """Follows the laser from scan to scan; the frame of everything is the laser's own, where it is now."""

    def __init__(self) -> None:
        self.keyframe_from_laser: Pose = IDENTITY
        self.velocity: Pose = IDENTITY
        """(3,) metres and radians per second."""
        self._covariance: NDArray[np.float64] = np.zeros((6, 6))
        self._stamp = 0
        self._followed = 0.0
        self._residual = 0.0
        self._keyframe = _NOTHING_SEEN

    @property
    def is_trusted(self) -> bool:
        """Whether it has followed the laser over several scans."""
        return self._followed >= _TRUSTED_AFTER

    def begin(self, stamp: int, keyframe_from_laser: Pose, velocity: Pose) -> None:
        """Begin anew at a scan, from what others say of it: a place (3,) and a velocity (3,)."""
        self._stamp, self.keyframe_from_laser, self.velocity = stamp, keyframe_from_laser, velocity
        self._covariance = np.zeros((6, 6))
        self._covariance[:3, :3], self._covariance[3:, 3:] = _FIRST_PLACE, _FIRST_VELOCITY
        self._followed = 0.0

    def start_keyframe(self, keyframe: PreparedScan) -> None:
        """The present scan is the keyframe from here on."""
        self._keyframe, self.keyframe_from_laser = keyframe, IDENTITY
        self._covariance[:3, :] = self._covariance[:, :3] = 0.0

    def advance(self, scan: Scan) -> bool:
        """Follow the laser to the next scan.

        False where that fails, and then it has to begin anew: the scan came late, or it does not lie where
        any velocity that is likely could have taken it.
        """
        followed, self._followed = self._followed, 0.0
        seconds = (scan.stamp - self._stamp) * 1e-9
        if not 0.0 < seconds <= _LONGEST:
            return False
        predicted = compose(self.keyframe_from_laser, self.velocity * seconds)
        covariance = _carried_on(self._covariance, seconds)
        # A sweep tells where the laser was in its middle, however wrongly it was corrected for the motion.
        middle = _middle_of(scan)
        observes = np.hstack([np.eye(3), middle * np.eye(3)])
        spread = observes @ covariance @ observes.T
        expected, known = compose(predicted, self.velocity * middle), _inverse(spread)
        matches = self._match(scan, middle, expected, known)
        surprise = between(expected, matches.poses[0])
        if matches.overlap[0] < _LEAST_OVERLAP or surprise @ known @ surprise > _INCREDIBLE:
            return False
        self._residual = float(matches.residual[0])
        left = _inverse(known + match_information(matches.hessians[0], self._residual))
        gain = covariance @ observes.T @ known
        correction = gain @ surprise
        self._covariance = covariance - gain @ (spread - left) @ gain.T
        self._stamp, self.keyframe_from_laser = scan.stamp, compose(predicted, correction[:3])
        self.velocity = self.velocity + correction[3:]
        self._followed = followed + min(1.0, seconds / _EACH_AFTER)
        return True

    def observe(self, keyframe_from_laser: Pose) -> None:
        """Take what scan odometry says of the place (3,).

        Along a bare corridor the filter goes on as before, and would when the car stands: what else the scans
        show there, door frames and lone points, scan odometry sees.
        """
        gain = self._covariance[:, :3] @ _inverse(self._covariance[:3, :3] + _SCAN_ODOMETRY)
        correction = gain @ between(self.keyframe_from_laser, keyframe_from_laser)
        self._covariance = self._covariance - gain @ self._covariance[:3]
        self.keyframe_from_laser = compose(self.keyframe_from_laser, correction[:3])
        self.velocity = self.velocity + correction[3:]

    def _match(self, scan: Scan, middle: float, expected: Pose, known: NDArray[np.float64]) -> Matches:
        """Where the laser was in the middle of a sweep, so many seconds after its stamp, from where it is
        ``expected`` (3,) with information (3, 3)."""
        motion = by_velocity(self.velocity)
        points = transform_points(inverse(motion(np.array([middle]))[0]), deskew(scan, motion))
        scans = ScanStore(2)
        pair = np.array([[scans.add(self._keyframe), scans.add(prepare_scan(points))]])
        prior = as_prior(known, self._residual)
        return match(expected[None], one_to_one(pair), scans, scans, prior_information=prior)

    def to_arrays(self) -> Arrays:
        """All there is to know: ``place`` and ``velocity`` (3,), their joint ``covariance`` (6, 6), the last
        ``stamp`` in nanoseconds, how many scans were ``followed``, the ``residual`` of the last match in
        metres, and the keyframe's ``points`` and ``normals`` (N, 2)."""
        return {
            "place": self.keyframe_from_laser,
            "velocity": self.velocity,
            "covariance": self._covariance,
            "stamp": np.array(self._stamp),
            "followed": np.array(self._followed),
            "residual": np.array(self._residual),
            "points": self._keyframe.points,
            "normals": self._keyframe.normals,
        }

    @classmethod
    def from_arrays(cls, arrays: Arrays) -> "VelocityFilter":
        """The filter that was written so."""
        tracker = cls()
        tracker.keyframe_from_laser = arrays["place"].astype(np.float64)
        tracker.velocity = arrays["velocity"].astype(np.float64)
        tracker._covariance = arrays["covariance"].astype(np.float64)
        tracker._stamp, tracker._followed = int(arrays["stamp"]), float(arrays["followed"])
        tracker._residual = float(arrays["residual"])
        tracker._keyframe = PreparedScan(
            arrays["points"].astype(np.float32), arrays["normals"].astype(np.float32)
        )
        return tracker


def _middle_of(scan: Scan) -> float:
    """Seconds after the stamp, of the returns."""
    offsets = scan.time_offsets[scan.is_return]
    return float(offsets.mean()) if len(offsets) else 0.0


def _inverse(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.linalg.inv(matrix), dtype=np.float64)


def _carried_on(covariance: NDArray[np.float64], seconds: float) -> NDArray[np.float64]:
    """The covariance (6, 6) of place and velocity so many seconds later.

    That the frame turns meanwhile is left out: it does so by a few hundredths of a radian.
    """
    transition = np.eye(6)
    transition[:3, 3:] = seconds * np.eye(3)
    noise = np.block(
        [
            [_ACCELERATION * seconds**3 / 3.0 + _ROUNDING, _ACCELERATION * seconds**2 / 2.0],
            [_ACCELERATION * seconds**2 / 2.0, _ACCELERATION * seconds],
        ]
    )
    return np.asarray(transition @ covariance @ transition.T + noise, dtype=np.float64)
