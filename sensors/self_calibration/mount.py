"""Where the laser sits on the base, and how far the wheels go for each metre by the scans.

With the base moved by (w, θ) in its own frame, the laser by (s, θ) in its own, and the laser at (l, φ) on the
base, ``w + R(θ) l = l + k R(φ) s``: hand-eye calibration in the plane, with the ratio k of both paths. This
is linear in l and k (cos φ, sin φ) [Censi et al., "Simultaneous calibration of odometry and sensor parameters
for mobile robots", T-RO 2013, section V].
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, wrap_angle
from racecar.sensors.self_calibration.robust_fit import MIN_BLOCKS, SIGMAS, robust_fit
from racecar.sensors.self_calibration.scan_track import ScanTrack
from racecar.sensors.self_calibration.shown_distance import shows_distance
from racecar.sensors.self_calibration.wheel_track import WheelSigns, WheelTrack, motion_pairs

FARTHEST_LASER = 1.0
"""Metres that a laser sits from the middle of the turns at most; by judgement: half a car."""
_MIN_YAW_ERROR = 0.15
"""Radians by which a yaw must surely be off to be worth a look. Measured on recordings that are right: 0.05
at most, and 0.15 with a scan in two seconds."""
_MIN_UNEXPLAINED_YAW = 0.26
"""The same, 15°, where slip may be why; by judgement: slip and steering make some degrees."""
LEAST_PATH, _MOST_PATH = 0.84, 1.15
"""Path by wheels over path by scans beyond which one of the two is wrong. Measured on recordings that are
right: 0.87 to 1.05; the mapper learns 10 % by itself, and with 20 % it bends a simulated building."""
_MIN_DISTANCE = 0.05
"""Metres that base and laser must travel in a window to have a direction; by judgement: five times the noise
of a track."""
_MAX_TURN_DIFFERENCE = 0.15
"""Radians by which both may differ in a window that is used; by judgement: a slip or a lost track."""
_NOISE = 0.005
"""Metres; motions over a window are never taken to be better; by judgement: what a track jitters by."""
_USUAL_DISTANCE = 0.3
"""Metres, standard deviation of the laser's place about the base's origin before anything was seen; by
judgement: half a small robot."""
_PRIOR = np.diag([(_NOISE / _USUAL_DISTANCE) ** 2] * 2 + [1e-9] * 2)
"""(4, 4) information, in units of the noise, that the laser sits near the base's origin, since without turns
nothing else tells."""
_MIN_CONSISTENCY = 0.7
"""Mean cosine of the angle between the directions of travel by wheels and by scans from which a place is
believed. Measured: 0.9 to 1 on robots that drive, 0.72 and more where scans were lost now and then, 0.66 and
less where hardly one was followed."""
_MAX_MISSED = 0.2
"""Share of the travel that may stay unexplained, in half of the windows, where the scans were followed well
enough to tell a distance. Measured: 0.01 to 0.17 on recordings whose scans were, 0.24 to 0.94 where they were
not."""
_MAX_DOUBT_OF_RIVAL = 0.5
"""Share of what one reading lacks to full consistency that a better one may lack. Measured on a simulated
drive: 0.005 where only the yaw is inverted."""
_MAX_PATH_RATIO = 4.0
"""Ratio of both paths, or its inverse, beyond which no place is believed; by judgement: feet for
metres are 3.3."""
_MAX_YAW_SIGMA, _MAX_RIGHT_ANGLE_SIGMA = 0.05, 0.1
"""Radians, standard deviation of the yaw at most, and near a multiple of a right angle; by judgement: three
degrees, and to the next right angle it is fifteen times the other."""
_RIGHT_ANGLE_TOLERANCE = 0.18
"""Radians, ten degrees, about a multiple of a right angle within which a laser is taken to be mounted so; by
judgement: people mount along edges."""
_MAX_SIDEWAYS = 0.1
"""Sine of the angle between the wheels' travel and their own axis up to which they drive along it. By
judgement: six degrees, less than the least error of a yaw."""
_MAX_ONE_WAY = 0.55
"""Length of the mean of the directions of travel, as unit vectors, up to which a robot drove hither and
thither, so that a slope on which it slips to one side does not look like a laser that is turned. Measured in
simulation: 0.58 where it had gone up such a slope and half of the way back, and still seemed turned."""
_MAX_OFFSET_SIGMA = 0.03
"""Metres, standard deviation of the laser's offset from the base up to which it is used; by judgement: a cell
of the map."""


@dataclass(frozen=True, eq=False)
class MountEstimate:
    """The laser's place as the motions have it, and the ratio of both paths."""

    base_from_laser: Pose
    """(3,)"""
    sigmas: Pose
    """(3,) standard deviations."""
    consistency: float
    """Mean cosine of the angle between the directions of travel by wheels and by scans."""
    missed: float
    """Share of the travel by wheels that scans and place do not explain, in half of the windows."""
    path_ratio: float
    """Path by wheels over path by scans."""
    path_sigma: float
    """Standard deviation of that."""
    sideways: float
    """Sine of the angle between the travel by wheels and their own axis, in half of the windows."""
    one_way: float
    """Length of the mean of the directions of travel by wheels, as unit vectors: 1 where it is always one."""

    @property
    def is_certain(self) -> bool:
        """Whether the motions leave no doubt about the yaw; less is asked for at a right angle, along which
        lasers are mounted. A laser that seems to sit beside its robot was followed wrongly."""
        distance, sigma = np.hypot(*self.base_from_laser[:2]), self.sigmas[:2].max()
        return (
            self.consistency >= _MIN_CONSISTENCY
            and bool(self.sigmas[2] <= (_MAX_RIGHT_ANGLE_SIGMA if self.is_at_right_angle else _MAX_YAW_SIGMA))
            and bool(distance - SIGMAS * sigma < FARTHEST_LASER)
            and 1.0 / _MAX_PATH_RATIO <= self.path_ratio <= _MAX_PATH_RATIO
        )

    @property
    def is_clear(self) -> bool:
        """Whether the motions also agree so well that they tell a distance."""
        return self.is_certain and self.missed < _MAX_MISSED

    @property
    def has_wrong_path(self) -> bool:
        """Whether wheels and scans surely go distances that differ by more than those of a sound robot."""
        low, high = (self.path_ratio + sign * SIGMAS * self.path_sigma for sign in (-1.0, 1.0))
        return self.is_clear and (high < LEAST_PATH or low > _MOST_PATH)

    def yaw_error(self, told: Pose) -> float:
        """Radians by which the yaw differs from that of the place (3,) that is ``told``; zero where slip may
        be why, or chance."""
        least = _MIN_YAW_ERROR if self.cannot_slip else _MIN_UNEXPLAINED_YAW
        return self._error_beyond(least, told)

    def leaves_open(self, told: Pose) -> bool:
        """Whether more motions would show if the yaw of the place (3,) that is ``told`` is wrong, or slip is
        why it seems so."""
        return self._error_beyond(_MIN_YAW_ERROR, told) != 0.0 and self.yaw_error(told) == 0.0

    def _error_beyond(self, least: float, told: Pose) -> float:
        error = float(wrap_angle(self.base_from_laser[2] - told[2]))
        return error if abs(error) - SIGMAS * float(self.sigmas[2]) > least else 0.0

    @property
    def cannot_slip(self) -> bool:
        """Whether the wheels drive along their own axis, and did so hither and thither, so that it is not
        they whose yaw is off, unless by half a turn."""
        return self.sideways < _MAX_SIDEWAYS and self.one_way < _MAX_ONE_WAY

    @property
    def is_at_right_angle(self) -> bool:
        """Whether the laser looks along an axis of the base, or nearly."""
        yaw = float(self.base_from_laser[2])
        return abs(yaw - _right_angle(yaw)) < _RIGHT_ANGLE_TOLERANCE

    def as_mounted(self) -> Pose:
        """(3,) the place with the yaw of a right angle where it is nearly that, and with an offset only where
        that shows, in metres of the scans if those of the wheels are others."""
        x, y, yaw = self.base_from_laser.tolist()
        scale = self.path_ratio if self.has_wrong_path else 1.0
        if self.is_at_right_angle:
            yaw = float(wrap_angle(_right_angle(yaw)))
        offsets = [
            value / scale if sigma < _MAX_OFFSET_SIGMA * scale and abs(value) > SIGMAS * sigma else 0.0
            for value, sigma in zip((x, y), self.sigmas[:2].tolist(), strict=True)
        ]
        return np.array([*offsets, yaw])


@dataclass(frozen=True, eq=False)
class MotionReading:
    """How wheels must be read to tell of the same motion as the scans of an upright laser."""

    mount: MountEstimate
    wheel_signs: WheelSigns


def read_motion(track: ScanTrack, wheels: WheelTrack, lag: int, *, is_inverted: bool) -> MotionReading | None:
    """The reading that fits; None where the robot travelled too little.

    Wheels whose path is the mirror image of what their own yaw says contradict themselves: they do not travel
    where they look. Wheels that are the mirror image of the truth do not, and look like a laser that hangs
    upside down; so with turns that are ``is_inverted`` either is possible.
    """
    sound, contradicting = (
        (WheelSigns.MIRRORED, WheelSigns.YAW_INVERTED)
        if is_inverted
        else (WheelSigns.AS_RECORDED, WheelSigns.PATH_MIRRORED)
    )
    mount, rival = (_mount_by(track, wheels.read_as(signs), lag) for signs in (sound, contradicting))
    if mount is None or rival is None:
        return None
    if 1.0 - rival.consistency < _MAX_DOUBT_OF_RIVAL * (1.0 - mount.consistency) and rival.is_certain:
        return MotionReading(rival, contradicting)
    return MotionReading(mount, sound)


def _mount_by(track: ScanTrack, wheels: WheelTrack, lag: int) -> MountEstimate | None:
    """The place that explains the motions best; None where the base travelled too seldom."""
    motions = motion_pairs(track, wheels, lag)
    laser, base = motions.by_scans, motions.by_wheels
    travels = (np.hypot(*base[:, :2].T) > _MIN_DISTANCE) & (np.hypot(*laser[:, :2].T) > _MIN_DISTANCE)
    is_used = np.abs(laser[:, 2] - base[:, 2]) < _MAX_TURN_DIFFERENCE
    for window in np.flatnonzero(travels & is_used):
        is_used[window] = shows_distance(track.scans[motions.begins[window]], laser[window])
    motions, travels = motions.chosen(is_used), travels[is_used]
    if len(np.unique(motions.blocks[travels])) < MIN_BLOCKS:
        return None
    laser, base = motions.by_scans, motions.by_wheels
    equations = _equations(laser, 0.5 * (laser[:, 2] + base[:, 2]))
    fit = robust_fit(equations, base[:, :2], motions.blocks, noise=_NOISE, prior=_PRIOR)
    x, y, cos, sin = fit.solution.tolist()
    ratio = max(float(np.hypot(cos, sin)), 1e-9)
    along = np.array([0.0, 0.0, cos, sin]) / ratio
    across = np.array([0.0, 0.0, -sin, cos]) / ratio**2
    variances = np.append(np.diag(fit.covariance)[:2], across @ fit.covariance @ across)
    predicted, told = (equations @ fit.solution)[travels], base[travels, :2]
    lengths = np.hypot(*predicted.T) * np.hypot(*told.T)
    cosines = (predicted * told).sum(axis=1) / np.maximum(lengths, 1e-9)
    misses = np.hypot(*(predicted - told).T) / np.hypot(*told.T)
    courses = np.arctan2(told[:, 1], told[:, 0])
    headings = wheels.at(track.stamps[motions.begins[travels]] + lag)[:, 2]
    return MountEstimate(
        base_from_laser=np.array([x, y, np.arctan2(sin, cos)]),
        sigmas=np.sqrt(variances),
        consistency=float(np.mean(cosines)),
        missed=float(np.median(misses)),
        path_ratio=ratio,
        path_sigma=float(np.sqrt(along @ fit.covariance @ along)),
        sideways=float(np.median(np.abs(np.sin(courses - 0.5 * base[travels, 2])))),
        one_way=float(np.abs(np.mean(np.exp(1j * (courses + headings))))),
    )


def _equations(laser: Pose, turns: NDArray[np.float64]) -> NDArray[np.float64]:
    """(W, 2, 4) by which (x, y, k cos, k sin) of the mount make the base's motion of the laser's (W, 3)."""
    cos, sin = np.cos(turns) - 1.0, np.sin(turns)
    along = np.stack([-cos, sin, laser[:, 0], -laser[:, 1]], axis=1)
    across = np.stack([-sin, -cos, laser[:, 1], laser[:, 0]], axis=1)
    return np.stack([along, across], axis=1)


def _right_angle(yaw: float) -> float:
    """The multiple of a right angle that is nearest."""
    return float(np.rint(yaw / (0.5 * np.pi)) * 0.5 * np.pi)
