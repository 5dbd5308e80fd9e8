"""Estimates the laser's motion since the last keyframe without wheels, from scans and its velocity.

Along an arc or a bare corridor scans hardly constrain the motion, and registration alone comes to a stop
there. But a car cannot change its velocity much between frequent scans. So a Kalman filter predicts it, with
white noise as its acceleration [Bar-Shalom, Li and Kirubarajan, Estimation with Applications to Tracking and
Navigation, 2001, section 6.2.2]. Its measurement is a match of each scan with the last keyframe, with the
prediction as the prior.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose, inverse, transform_points
from racecar.sensors.matching.match_information import as_prior, match_information
from racecar.sensors.matching.scan_matching import Matches, Pairings, match
from racecar.sensors.matching.scan_store import PreparedScan, ScanStore, prepare_scan
from racecar.sensors.motion.deskew import by_velocity, deskew, seen_by
from racecar.sensors.scan import Scan

_ROUNDING = 1e-6 * np.eye(3)
"""Square metres and radians added per match, because it ends where steps are short, not where they are
zero."""
_MAX_INTERVAL = 0.25
"""Maximum seconds between two scans for which the velocity is a useful prediction. Measured: serves lasers of
five scans a second (pytest tests/simulated/test_hard_places.py)."""
_ACCELERATION = np.diag([3.0, 1.0, 6.0]) ** 2
"""(3, 3) spectral density of the white noise in forward and sideways acceleration (m/s², over a second) and
angular acceleration (rad/s²): the velocity gained in a second, squared. Chosen by judgement: a race car."""
_INITIAL_VELOCITY = np.diag([2.0, 0.5, 2.0]) ** 2
"""(3, 3) covariance of the initial velocity: m/s, m/s, rad/s. Chosen by judgement: a race car."""
_INITIAL_PLACE = np.diag([0.02, 0.02, 0.02]) ** 2
"""(3, 3) covariance of the initial pose: m, m, rad. Chosen by judgement: a scan match."""
_SCAN_ODOMETRY = np.diag([0.5, 0.5, 0.25]) ** 2
"""(3, 3) covariance of scan odometry's step since the keyframe: m, m, rad. So wide that it matters only where
scan matches leave a direction unconstrained, which aces without wheels showed to be necessary."""
_MIN_OVERLAP = 0.2
"""Minimum share of points that must match the keyframe. Chosen by judgement: fewer match by chance."""
_MAX_SURPRISE = 40.0
"""Squared Mahalanobis distance between prediction and match above which the filter restarts. Chosen by
judgement: under the chi-square distribution of three dimensions 16 is exceeded once in a thousand times, but
accelerations have heavier tails."""
_TRUSTED_AFTER = 10.0
"""Scans to follow before the filter is trusted. Chosen by judgement: by then the velocity has converged."""
_FULL_INTERVAL = 0.05
"""Seconds between two scans above which a scan counts fully towards that. More frequent ones count in
proportion, because velocities are wrong where stamps come in bunches."""
_NOTHING_SEEN = PreparedScan(np.zeros((0, 2), dtype=np.float32), np.zeros((0, 2), dtype=np.float32))
"""The keyframe before the first, which has no points by definition."""


class TurnMeasured(NamedTuple):
    """The motion that a gyroscope measured between two scans."""

    turn: float
    """Radians."""
    variance: float
    """Square radians."""
    rate_in_sweep: float
    """Radians per second while the scan was taken."""
    base_from_laser: Pose
    """(3,) mount of the laser that is followed."""


class VelocityFilter:
    """Follows the laser from scan to scan; everything is in the current frame of the laser."""

    def __init__(self) -> None:
        self.keyframe_from_laser: Pose = IDENTITY
        self.velocity: Pose = IDENTITY
        """(3,) metres and radians per second."""
        self._covariance: NDArray[np.float64] = np.zeros((6, 6))
        self._stamp = 0
        self._followed = 0.0
        self._residual = 0.0
        self._keyframe = _NOTHING_SEEN
        self._keyframe_mount: Pose = IDENTITY

    @property
    def is_trusted(self) -> bool:
        """Whether it has followed the laser over several scans."""
        return self._followed >= _TRUSTED_AFTER

    def begin(self, stamp: int, keyframe_from_laser: Pose, velocity: Pose) -> None:
        """Restart at a scan, with a pose (3,) and velocity (3,) estimated elsewhere."""
        self._stamp, self.keyframe_from_laser, self.velocity = stamp, keyframe_from_laser, velocity
        self._covariance = np.zeros((6, 6))
        self._covariance[:3, :3] = _INITIAL_PLACE
        self._covariance[3:, 3:] = _INITIAL_VELOCITY
        self._followed = 0.0

    def start_keyframe(self, keyframe: PreparedScan, mount: Pose | None = None) -> None:
        """Make the current scan the keyframe; ``mount`` as in `advance`."""
        self._keyframe_mount = IDENTITY if mount is None else mount
        self._keyframe, self.keyframe_from_laser = keyframe, IDENTITY
        self._covariance[:3, :] = self._covariance[:, :3] = 0.0

    def advance(self, scan: Scan, mount: Pose | None = None, turned: TurnMeasured | None = None) -> bool:
        """Follow the laser to the next scan, which may be of another laser at ``mount`` (3,) in the frame of
        this one; a gyroscope may add its turn.

        Returns False if that fails, and the filter then has to restart: the scan came late, or no likely
        velocity explains its match.
        """
        followed, self._followed = self._followed, 0.0
        seconds = (scan.stamp - self._stamp) * 1e-9
        if not 0.0 < seconds <= _MAX_INTERVAL:
            return False
        if turned is not None:
            self._take_turn(turned.turn / seconds, turned.variance / seconds**2, turned.base_from_laser)
        predicted = compose(self.keyframe_from_laser, self.velocity * seconds)
        covariance = self._predicted_covariance(seconds, is_turn_known=turned is not None)
        if turned is not None:
            self._set_rate(turned.rate_in_sweep, turned.base_from_laser)
        # A sweep determines the laser's pose at its mid-time, however wrongly it was corrected for motion.
        middle = _middle_of(scan)
        observes = np.hstack([np.eye(3), middle * np.eye(3)])
        spread = observes @ covariance @ observes.T
        expected, known = compose(predicted, self.velocity * middle), _inverse(spread)
        matches = self._match(scan, middle, expected, known, mount)
        surprise = between(expected, matches.poses[0])
        is_incredible = surprise @ known @ surprise > _MAX_SURPRISE
        if matches.overlap[0] < _MIN_OVERLAP or is_incredible:
            return False
        self._residual = float(matches.residual[0])
        left = _inverse(known + match_information(matches.hessians[0], self._residual))
        gain = covariance @ observes.T @ known
        correction = gain @ surprise
        self._covariance = covariance - gain @ (spread - left) @ gain.T
        self._stamp, self.keyframe_from_laser = scan.stamp, compose(predicted, correction[:3])
        self.velocity = self.velocity + correction[3:]
        self._followed = followed + min(1.0, seconds / _FULL_INTERVAL)
        return True

    def observe(self, keyframe_from_laser: Pose) -> None:
        """Add the pose (3,) estimated by scan odometry.

        Along a bare corridor the filter keeps its velocity even when the car stops. Door frames and lone
        points there are left out of line matching, but still affect scan odometry.
        """
        spread = self._covariance[:3, :3] + _SCAN_ODOMETRY
        gain = self._covariance[:, :3] @ _inverse(spread)
        correction = gain @ between(self.keyframe_from_laser, keyframe_from_laser)
        self._covariance = self._covariance - gain @ self._covariance[:3]
        self.keyframe_from_laser = compose(self.keyframe_from_laser, correction[:3])
        self.velocity = self.velocity + correction[3:]

    def _take_turn(self, rate: float, variance: float, base_from_laser: Pose) -> None:
        """The rate of turn is measured, not estimated: it is an input of the filter."""
        self._set_rate(rate, base_from_laser)
        self._covariance[5, :] = self._covariance[:, 5] = 0.0
        self._covariance[5, 5] = variance

    def _set_rate(self, rate: float, base_from_laser: Pose) -> None:
        """A laser away from the car's centre of rotation moves sideways as the car turns."""
        lever = inverse(base_from_laser)[:2]  # from the laser to the base
        gained = rate - self.velocity[2]
        self.velocity = self.velocity + gained * np.array([lever[1], -lever[0], 1.0])

    def _match(
        self, scan: Scan, middle: float, expected: Pose, known: NDArray[np.float64], mount: Pose | None
    ) -> Matches:
        """Pose of the laser at the mid-time of a sweep, ``middle`` seconds after its stamp, which is
        ``expected`` (3,) with information ``known`` (3, 3)."""
        motion = seen_by(mount, by_velocity(self.velocity))
        points = transform_points(inverse(motion(np.array([middle]))[0]), deskew(scan, motion))
        scans = ScanStore(2)
        pair = np.array([[scans.add(self._keyframe), scans.add(prepare_scan(points))]])
        prior = as_prior(known, self._residual)
        at = np.array([[self._keyframe_mount], [IDENTITY if mount is None else mount]])
        pairings = Pairings(np.arange(2), pair, *at)
        return match(expected[None], pairings, scans, scans, prior_information=prior)

    def _predicted_covariance(self, seconds: float, *, is_turn_known: bool) -> NDArray[np.float64]:
        """Covariance (6, 6) of pose and velocity after this many seconds; a known turn does not accelerate.

        The rotation of the frame in that time, a few hundredths of a radian, is neglected.
        """
        transition = np.eye(6)
        transition[:3, 3:] = seconds * np.eye(3)
        density = np.diag([1.0, 1.0, 0.0]) @ _ACCELERATION if is_turn_known else _ACCELERATION
        noise = np.block(
            [
                [density * seconds**3 / 3.0 + _ROUNDING, density * seconds**2 / 2.0],
                [density * seconds**2 / 2.0, density * seconds],
            ]
        )
        return np.asarray(transition @ self._covariance @ transition.T + noise, dtype=np.float64)


def _middle_of(scan: Scan) -> float:
    """Mean time of the returns in seconds after the stamp."""
    offsets = scan.time_offsets[scan.is_return]
    return float(offsets.mean()) if len(offsets) else 0.0


def _inverse(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.linalg.inv(matrix), dtype=np.float64)
