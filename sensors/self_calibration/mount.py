"""Estimate the laser's pose on the base, and the ratio of path lengths by wheels and by scans.

If the base moves by (w, θ) in its own frame, the laser by (s, θ) in its own, and the laser is mounted at (l,
φ), then ``w + R(θ) l = l + k R(φ) s``: planar hand-eye calibration with path ratio k. This is linear in l and
k (cos φ, sin φ) [Censi et al., "Simultaneous calibration of odometry and sensor parameters for mobile
robots", T-RO 2013, section V].
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
"""Maximum distance in metres of a laser from the centre of rotation. Chosen by judgement: half a car."""
_MIN_YAW_ERROR = 0.15
"""Radians of certain yaw error from which it is considered. Measured on recordings that are right: 0.05 at
most, and 0.15 with a scan in two seconds."""
_MIN_UNEXPLAINED_YAW = 0.26
"""The same, 15°, where slip may be the cause. Chosen by judgement: slip and steering cause some degrees."""
LEAST_PATH, _MOST_PATH = 0.84, 1.15
"""Range of the path ratio, wheels over scans, beyond which one is wrong. Measured on recordings that are
right: 0.87 to 1.05; the mapper learns 10 % by itself, and with 20 % it bends a simulated building."""
_MIN_DISTANCE = 0.05
"""Metres that base and laser must travel in a window to have a direction. Chosen by judgement: five times the
noise of a track."""
_MAX_TURN_DIFFERENCE = 0.15
"""Radians by which their rotations may differ. Chosen by judgement: more is slip or a lost track."""
_NOISE = 0.005
"""Metres, lower bound of the noise of motions over a window. Chosen by judgement: jitter of a track."""
_USUAL_DISTANCE = 0.3
"""Metres, prior standard deviation of the laser's position about the base's origin. Chosen by judgement: half
a small robot."""
_PRIOR = np.diag([(_NOISE / _USUAL_DISTANCE) ** 2] * 2 + [1e-9] * 2)
"""(4, 4) prior information, in units of the noise, that the laser is near the base's origin, since without
turns its position is unobservable."""
_MIN_CONSISTENCY = 0.7
"""Minimum mean cosine of the angle between directions of travel by wheels and by scans. Measured: 0.9 to 1 on
robots that drive, 0.72 and more where scans were lost now and then, 0.66 and less where hardly one was
followed."""
_MAX_MISSED = 0.2
"""Maximum median share of unexplained travel for scans tracked well enough to measure distance. Measured:
0.01 to 0.17 on recordings whose scans were, 0.24 to 0.94 where they were not."""
_MAX_DOUBT_OF_RIVAL = 0.5
"""Inconsistency of a better reading relative to another, at most. Measured on a simulated drive: 0.005 where
only the yaw is inverted."""
_MAX_PATH_RATIO = 4.0
"""Largest accepted path ratio, or its inverse. Chosen by judgement: feet for metres are 3.3."""
_MAX_YAW_SIGMA, _MAX_RIGHT_ANGLE_SIGMA = 0.05, 0.1
"""Radians, maximum standard deviation of the yaw, in general and near a multiple of a right angle. Chosen by
judgement: three degrees, and to the next right angle it is fifteen times the other."""
_RIGHT_ANGLE_TOLERANCE = 0.18
"""Radians, ten degrees, within which a yaw is rounded to a multiple of a right angle. Chosen by judgement:
lasers are mounted along edges."""
_MAX_SIDEWAYS = 0.1
"""Sine of the angle between travel and heading up to which wheels drive straight ahead. Chosen by judgement:
six degrees, less than the smallest yaw error."""
_MAX_ONE_WAY = 0.55
"""Length of the mean unit vector of travel up to which a robot drove back and forth, so that slipping
sideways on a slope is not taken for a rotated laser. Measured in simulation: 0.58 where it had gone up such a
slope and halfway back, and still seemed turned."""
_MAX_OFFSET_SIGMA = 0.03
"""Metres, maximum standard deviation of an offset that is used. Chosen by judgement: a cell of the map."""


@dataclass(frozen=True, eq=False)
class MountEstimate:
    """The laser's mount and the path ratio, estimated from motion."""

    base_from_laser: Pose
    """(3,)"""
    sigmas: Pose
    """(3,) standard deviations in metres and radians."""
    consistency: float
    """Mean cosine of the angle between directions of travel by wheels and by scans."""
    missed: float
    """Median share of the wheels' travel that scans and mount do not explain."""
    path_ratio: float
    """Path length by wheels relative to that by scans."""
    path_sigma: float
    """Standard deviation of the path ratio."""
    sideways: float
    """Median sine of the angle between the wheels' travel and their heading."""
    one_way: float
    """Length of the mean unit vector of the wheels' travel: 1 if it is always in one direction."""

    @property
    def is_certain(self) -> bool:
        """Whether the yaw is beyond doubt. Near a right angle, along which lasers are mounted, less is
        required. A laser that seems to be outside its robot was tracked wrongly."""
        distance, sigma = np.hypot(*self.base_from_laser[:2]), self.sigmas[:2].max()
        return (
            self.consistency >= _MIN_CONSISTENCY
            and bool(self.sigmas[2] <= (_MAX_RIGHT_ANGLE_SIGMA if self.is_at_right_angle else _MAX_YAW_SIGMA))
            and bool(distance - SIGMAS * sigma < FARTHEST_LASER)
            and 1.0 / _MAX_PATH_RATIO <= self.path_ratio <= _MAX_PATH_RATIO
        )

    @property
    def is_clear(self) -> bool:
        """Whether the motions also agree well enough to measure distance."""
        return self.is_certain and self.missed < _MAX_MISSED

    @property
    def has_wrong_path(self) -> bool:
        """Whether the path ratio is certainly out of range."""
        low, high = (self.path_ratio + sign * SIGMAS * self.path_sigma for sign in (-1.0, 1.0))
        return self.is_clear and (high < LEAST_PATH or low > _MOST_PATH)

    def yaw_error(self, stated: Pose) -> float:
        """Radians by which the yaw differs from that of the ``stated`` mount (3,); zero where slip or chance
        may be the cause."""
        least = _MIN_YAW_ERROR if self.cannot_slip else _MIN_UNEXPLAINED_YAW
        return self._error_beyond(least, stated)

    def leaves_open(self, stated: Pose) -> bool:
        """Whether more motion could decide if the yaw of the ``stated`` mount (3,) is wrong or slip is the
        cause."""
        return self._error_beyond(_MIN_YAW_ERROR, stated) != 0.0 and self.yaw_error(stated) == 0.0

    def _error_beyond(self, least: float, stated: Pose) -> float:
        error = float(wrap_angle(self.base_from_laser[2] - stated[2]))
        return error if abs(error) - SIGMAS * float(self.sigmas[2]) > least else 0.0

    def proves(self, place: Pose, other: Pose) -> bool:
        """Whether this shows one mount (3,) rather than another, by far more than chance."""
        away, other_away = (
            float(np.linalg.norm([x, y, wrap_angle(yaw)] / self.sigmas))
            for x, y, yaw in (self.base_from_laser - place, self.base_from_laser - other)
        )
        return self.is_clear and away + SIGMAS < other_away

    @property
    def cannot_slip(self) -> bool:
        """Whether slip is ruled out as the cause of a yaw error, unless of half a turn: the wheels drove
        straight ahead, and back and forth."""
        return self.sideways < _MAX_SIDEWAYS and self.one_way < _MAX_ONE_WAY

    @property
    def is_at_right_angle(self) -> bool:
        """Whether the laser is nearly aligned with an axis of the base."""
        yaw = float(self.base_from_laser[2])
        return abs(yaw - _right_angle(yaw)) < _RIGHT_ANGLE_TOLERANCE

    def as_mounted(self) -> Pose:
        """(3,) the mount to use: yaw rounded to a right angle if close, offsets only where significant, in
        metres of the scans if those of the wheels differ."""
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
    """Signs and mount with which wheels and the scans of an upright laser show the same motion."""

    mount: MountEstimate
    wheel_signs: WheelSigns


def read_motion(track: ScanTrack, wheels: WheelTrack, lag: int, *, is_inverted: bool) -> MotionReading | None:
    """The reading that fits; None where the robot travelled too little.

    Wheels whose path mirrors their own yaw contradict themselves: they do not travel where they head. Wheels
    that mirror the truth are consistent and look like an upside-down laser. So if turns are ``is_inverted``,
    either is possible.
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
    """The mount that best explains the motions; None where the base travelled too little."""
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
    predicted, driven = (equations @ fit.solution)[travels], base[travels, :2]
    lengths = np.hypot(*predicted.T) * np.hypot(*driven.T)
    cosines = (predicted * driven).sum(axis=1) / np.maximum(lengths, 1e-9)
    misses = np.hypot(*(predicted - driven).T) / np.hypot(*driven.T)
    courses = np.arctan2(driven[:, 1], driven[:, 0])
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
    """(W, 2, 4) maps (x, y, k cos, k sin) of the mount to the base's motion, given the laser's (W, 3)."""
    cos, sin = np.cos(turns) - 1.0, np.sin(turns)
    along = np.stack([-cos, sin, laser[:, 0], -laser[:, 1]], axis=1)
    across = np.stack([-sin, -cos, laser[:, 1], laser[:, 0]], axis=1)
    return np.stack([along, across], axis=1)


def _right_angle(yaw: float) -> float:
    """The nearest multiple of a right angle."""
    return float(np.rint(yaw / (0.5 * np.pi)) * 0.5 * np.pi)
