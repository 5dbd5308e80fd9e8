"""The laser's motion since the last keyframe where no wheels report it, by scans and by its velocity.

Along an arc or a bare corridor scans hardly constrain the motion, and registration alone comes to a stop
there. But a car cannot change its velocity much between scans that come often. So a Kalman filter predicts
it, with white noise for its acceleration [Bar-Shalom, Li and Kirubarajan, Estimation with Applications to
Tracking and Navigation, 2001, section 6.2.2]; its measurement is a match of each scan with the last
keyframe, for which the prediction is the prior.
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
"""Square metres and radians that each match adds, because it ends where steps are short, not where they are
zero."""
_MAX_INTERVAL = 0.25
"""Seconds between two scans beyond which a velocity predicts too little. Measured: serves lasers of five
scans a second (pytest tests/simulated/test_hard_places.py)."""
_ACCELERATION = np.diag([3.0, 1.0, 6.0]) ** 2
"""(3, 3) spectral density of the white noise in forward and sideways acceleration (m/s², over a second) and
angular acceleration (rad/s²): what velocity gains in a second, squared. By judgement: what a race car
does."""
_INITIAL_VELOCITY = np.diag([2.0, 0.5, 2.0]) ** 2
"""(3, 3) covariance of the velocity at the start: m/s, m/s, rad/s. By judgement: of a race car."""
_INITIAL_PLACE = np.diag([0.02, 0.02, 0.02]) ** 2
"""(3, 3) covariance of the place at the start: m, m, rad. By judgement: a scan match's."""
_SCAN_ODOMETRY = np.diag([0.5, 0.5, 0.25]) ** 2
"""(3, 3) covariance of what scan odometry tells of a step since the keyframe: m, m, rad. So wide that it
decides only where scan matches leave a direction open, since aces without wheels showed the need."""
_MIN_OVERLAP = 0.2
"""Share of points that must match the keyframe for a scan to be followed. By judgement: fewer match by
chance."""
_MAX_SURPRISE = 40.0
"""Squared Mahalanobis distance between prediction and match beyond which the filter starts again. By
judgement: by the chi-square distribution of three dimensions 16 is exceeded once in a thousand times, but
accelerations have heavier tails."""
_TRUSTED_AFTER = 10.0
"""Scans that must have been followed until it is trusted. By judgement: by then the velocity has settled."""
_FULL_INTERVAL = 0.05
"""Seconds between two scans from which one counts in full towards that; sooner ones count in proportion,
because velocities are wrong where stamps come in bunches."""
_NOTHING_SEEN = PreparedScan(np.zeros((0, 2), dtype=np.float32), np.zeros((0, 2), dtype=np.float32))
"""The keyframe before the first, which by definition shows no point."""


class TurnMeasured(NamedTuple):
    """What a gyroscope says of the time between two scans."""

    turn: float
    """Radians."""
    variance: float
    """Square radians."""
    rate_in_sweep: float
    """Radians per second while the scan was taken."""
    base_from_laser: Pose
    """(3,) the mount of the laser that is followed."""


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
        self._keyframe_mount: Pose = IDENTITY

    @property
    def is_trusted(self) -> bool:
        """Whether it has followed the laser over several scans."""
        return self._followed >= _TRUSTED_AFTER

    def begin(self, stamp: int, keyframe_from_laser: Pose, velocity: Pose) -> None:
        """Begin anew at a scan, at a place (3,) and with a velocity (3,) that others estimate."""
        self._stamp, self.keyframe_from_laser, self.velocity = stamp, keyframe_from_laser, velocity
        self._covariance = np.zeros((6, 6))
        self._covariance[:3, :3] = _INITIAL_PLACE
        self._covariance[3:, 3:] = _INITIAL_VELOCITY
        self._followed = 0.0

    def start_keyframe(self, keyframe: PreparedScan, mount: Pose | None = None) -> None:
        """The present scan is the keyframe from here on; ``mount`` as in `advance`."""
        self._keyframe_mount = IDENTITY if mount is None else mount
        self._keyframe, self.keyframe_from_laser = keyframe, IDENTITY
        self._covariance[:3, :] = self._covariance[:, :3] = 0.0

    def advance(self, scan: Scan, mount: Pose | None = None, turned: TurnMeasured | None = None) -> bool:
        """Follow the laser to the next scan; one of another laser, mounted at ``mount`` (3,) seen from it,
        tells of the motion too, and so may a gyroscope.

        False where that fails, and then it has to begin anew: the scan came late, or it does not lie where
        any likely velocity could have taken it.
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
        # A sweep shows where the laser was in its middle, however wrongly it was corrected for the motion.
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
        """Take the place (3,) that scan odometry estimates.

        Along a bare corridor the filter goes on at its velocity, even when the car stops; door frames and
        lone points there, which matches of lines leave out, still show in scan odometry.
        """
        spread = self._covariance[:3, :3] + _SCAN_ODOMETRY
        gain = self._covariance[:, :3] @ _inverse(spread)
        correction = gain @ between(self.keyframe_from_laser, keyframe_from_laser)
        self._covariance = self._covariance - gain @ self._covariance[:3]
        self.keyframe_from_laser = compose(self.keyframe_from_laser, correction[:3])
        self.velocity = self.velocity + correction[3:]

    def _take_turn(self, rate: float, variance: float, base_from_laser: Pose) -> None:
        """The rate of turn is measured and not estimated: the filter takes it as an input."""
        self._set_rate(rate, base_from_laser)
        self._covariance[5, :] = self._covariance[:, 5] = 0.0
        self._covariance[5, 5] = variance

    def _set_rate(self, rate: float, base_from_laser: Pose) -> None:
        """A laser that does not sit where the car turns about moves sideways as it turns."""
        lever = inverse(base_from_laser)[:2]  # from the laser to the base
        gained = rate - self.velocity[2]
        self.velocity = self.velocity + gained * np.array([lever[1], -lever[0], 1.0])

    def _match(
        self, scan: Scan, middle: float, expected: Pose, known: NDArray[np.float64], mount: Pose | None
    ) -> Matches:
        """Where the laser was in the middle of a sweep, ``middle`` seconds after its stamp; it is
        ``expected`` (3,) with the information ``known`` (3, 3)."""
        motion = seen_by(mount, by_velocity(self.velocity))
        points = transform_points(inverse(motion(np.array([middle]))[0]), deskew(scan, motion))
        scans = ScanStore(2)
        pair = np.array([[scans.add(self._keyframe), scans.add(prepare_scan(points))]])
        prior = as_prior(known, self._residual)
        at = np.array([[self._keyframe_mount], [IDENTITY if mount is None else mount]])
        pairings = Pairings(np.arange(2), pair, *at)
        return match(expected[None], pairings, scans, scans, prior_information=prior)

    def _predicted_covariance(self, seconds: float, *, is_turn_known: bool) -> NDArray[np.float64]:
        """The covariance (6, 6) of place and velocity so many seconds later; a known turn does not
        accelerate.

        The rotation of the frame meanwhile, by a few hundredths of a radian, is neglected.
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
    """Seconds after the stamp, of the returns."""
    offsets = scan.time_offsets[scan.is_return]
    return float(offsets.mean()) if len(offsets) else 0.0


def _inverse(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.linalg.inv(matrix), dtype=np.float64)
