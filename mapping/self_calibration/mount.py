"""Where the laser sits on the base, by the motions of both: hand-eye calibration in the plane.

With the base moved by (w, θ) in its own frame, the laser by (s, θ) in its own, and the laser at (l, φ) on the
base, ``w + R(θ) l = l + R(φ) s``. This is linear in l and (cos φ, sin φ) [Censi et al., "Simultaneous
calibration of odometry and sensor parameters for mobile robots", T-RO 2013, section V], and is solved so, by
least squares with Cauchy weights, since wheels slip; the length of (cos φ, sin φ) is left free and is the
ratio of both paths.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.self_calibration.scan_track import ScanTrack
from racecar.mapping.self_calibration.wheel_track import (
    MotionPairs,
    WheelSigns,
    WheelTrack,
    motion_pairs,
    windows_of,
)
from racecar.maps.geometry.se2 import Pose, wrap_angle

_ROUNDS = 10
"""Of reweighting, since the weights hardly change after a few."""
_MIN_DISTANCE = 0.05
"""Metres that base and laser must travel in a window to have a direction; by judgement: five times the noise
of a track."""
MAX_TURN_DIFFERENCE = 0.15
"""Radians by which wheels and scans may differ in a window that is used; by judgement: a slip or a lost
track."""
_MIN_WINDOWS, _MIN_CERTAIN_WINDOWS = 6, 15
"""Windows with travel below which nothing is estimated, and below which nothing is believed that speaks
against the recording; by judgement: the first are three times the unknowns, with two equations each."""
_MIN_NOISE = 0.005
"""Metres; motions over a window are never taken to be better; by judgement: what a track jitters by."""
_USUAL_DISTANCE = 0.3
"""Metres, standard deviation of the laser's place about the base's origin before anything was seen; by
judgement: half a small robot."""
_MIN_CONSISTENCY = 0.8
"""Mean cosine of the angle between the directions of travel by wheels and by scans from which a place is
believed. Measured: 0.9 to 1 on robots that drive."""
_MAX_YAW_SIGMA, _MAX_RIGHT_ANGLE_SIGMA = 0.05, 0.1
"""Radians, standard deviation of the yaw at most, and near a multiple of a right angle; by judgement: three
degrees, and to the next right angle it is fifteen times the other."""
_MAX_OFFSET_SIGMA = 0.03
"""Metres, standard deviation of the laser's offset from the base up to which it is used; by judgement: a cell
of the map."""
_OFFSET_SIGMAS = 3.0
"""Standard deviations that an offset must show by, since that is usual."""
_MAX_DOUBT_OF_RIVAL = 0.5
"""Share of what one reading lacks to full consistency that a better one may lack. Measured on a simulated
drive: 0.005 where only the yaw is inverted."""
_MAX_PATH_RATIO = 3.0
"""Ratio of the paths by wheels and by scans, or its inverse, beyond which neither is believed; by judgement:
feet are metres by more than that."""
MIN_PATH_CONSISTENCY = 0.98
"""Mean cosine between the directions of travel below which the scans were not followed well enough to tell a
distance. Measured: 0.999 on simulated drives, 0.88 on a recording whose wheels are right and whose scans seem
to go half as far again."""
MIN_YAW_ERROR = 0.26
"""Radians, 15°, by which a yaw must be off to be a fault of its own; by judgement: slip and steering make
some degrees."""
_RIGHT_ANGLE_TOLERANCE = 0.18
"""Radians, ten degrees, about a multiple of a right angle within which a laser is taken to be mounted so; by
judgement: people mount along edges."""


@dataclass(frozen=True, eq=False)
class MountEstimate:
    """The laser's place as the motions have it."""

    base_from_laser: Pose
    """(3,)"""
    sigmas: Pose
    """(3,) standard deviations."""
    consistency: float
    """Mean cosine of the angle between the directions of travel by wheels and by scans."""
    windows: int
    """In which the base travelled."""
    path_ratio: float
    """Path by wheels over path by scans."""

    @property
    def is_certain(self) -> bool:
        """Whether the motions leave no doubt about the yaw; less is asked for at a right angle, along which
        lasers are mounted."""
        max_sigma = _MAX_RIGHT_ANGLE_SIGMA if self.is_at_right_angle else _MAX_YAW_SIGMA
        return (
            self.windows >= _MIN_CERTAIN_WINDOWS
            and self.consistency >= _MIN_CONSISTENCY
            and float(self.sigmas[2]) <= max_sigma
            and 1.0 / _MAX_PATH_RATIO <= self.path_ratio <= _MAX_PATH_RATIO
        )

    @property
    def is_at_right_angle(self) -> bool:
        """Whether the laser looks along an axis of the base, or nearly."""
        yaw = float(self.base_from_laser[2])
        return abs(yaw - _right_angle(yaw)) < _RIGHT_ANGLE_TOLERANCE

    def as_mounted(self) -> Pose:
        """(3,) the place with the yaw of a right angle where it is nearly that, and with an offset only where
        that shows."""
        x, y, yaw = self.base_from_laser.tolist()
        if self.is_at_right_angle:
            yaw = float(wrap_angle(_right_angle(yaw)))
        offsets = [
            value if sigma < _MAX_OFFSET_SIGMA and abs(value) > _OFFSET_SIGMAS * sigma else 0.0
            for value, sigma in zip((x, y), self.sigmas[:2].tolist(), strict=True)
        ]
        return np.array([*offsets, yaw])


@dataclass(frozen=True, eq=False)
class MotionReading:
    """How scans and wheels must be read to tell of the same motion."""

    mount: MountEstimate
    is_mirrored: bool = False
    """Whether one of the two counts turns backwards, as a laser does that hangs upside down; the ``mount`` is
    that of such a laser."""
    wheel_signs: WheelSigns = WheelSigns.AS_RECORDED

    def seen_upright(self) -> "MotionReading":
        """Of mirrored motions, the reading by which the wheels are wrong and not the laser."""
        mount = replace(self.mount, base_from_laser=self.mount.base_from_laser * [1.0, -1.0, -1.0])
        return MotionReading(mount, wheel_signs=WheelSigns.MIRRORED)


def read_motion(track: ScanTrack, wheels: WheelTrack, lag: int, *, is_inverted: bool) -> MotionReading | None:
    """The reading that fits; None where the robot travelled too little.

    With turns that are ``is_inverted``, wheels whose yaw alone is wrong contradict themselves: they do not
    travel where they look. Wheels that are the mirror image of the truth do not, and look like a laser that
    hangs upside down.
    """
    windows = windows_of(track)

    def mount(scans: ScanTrack, signs: WheelSigns) -> MountEstimate | None:
        return estimate_mount(motion_pairs(scans, wheels.read_as(signs), windows, lag))

    if not is_inverted:
        upright = mount(track, WheelSigns.AS_RECORDED)
        return None if upright is None else MotionReading(upright)
    mirrored, turned = mount(track.mirrored(), WheelSigns.AS_RECORDED), mount(track, WheelSigns.YAW_INVERTED)
    if mirrored is None or turned is None:
        return None
    if 1.0 - turned.consistency < _MAX_DOUBT_OF_RIVAL * (1.0 - mirrored.consistency):
        return MotionReading(turned, wheel_signs=WheelSigns.YAW_INVERTED)
    return MotionReading(mirrored, is_mirrored=True)


def estimate_mount(motions: MotionPairs) -> MountEstimate | None:
    """The place that explains the motions best; None where the base travelled too seldom."""
    is_used = np.abs(motions.by_scans[:, 2] - motions.by_wheels[:, 2]) < MAX_TURN_DIFFERENCE
    base, laser = motions.by_wheels[is_used], motions.by_scans[is_used]
    travels = (np.hypot(base[:, 0], base[:, 1]) > _MIN_DISTANCE) & (
        np.hypot(laser[:, 0], laser[:, 1]) > _MIN_DISTANCE
    )
    if np.count_nonzero(travels) < _MIN_WINDOWS:
        return None
    equations = _equations(laser, 0.5 * (laser[:, 2] + base[:, 2]))
    solution, covariance = _robust_solution(equations, base[:, :2])
    x, y, cos, sin = solution.tolist()
    length = max(float(np.hypot(cos, sin)), 1e-9)
    across = np.array([0.0, 0.0, -sin, cos]) / length**2
    variances = np.append(np.diag(covariance)[:2], across @ covariance @ across)
    predicted = (equations @ solution)[travels]
    cosines = (predicted * base[travels, :2]).sum(axis=1) / np.maximum(
        np.hypot(*predicted.T) * np.hypot(*base[travels, :2].T), 1e-9
    )
    return MountEstimate(
        base_from_laser=np.array([x, y, np.arctan2(sin, cos)]),
        sigmas=np.sqrt(variances),
        consistency=float(np.mean(cosines)),
        windows=int(np.count_nonzero(travels)),
        path_ratio=length,
    )


def _equations(laser: Pose, turns: NDArray[np.float64]) -> NDArray[np.float64]:
    """(W, 2, 4) by which (x, y, cos, sin) of the mount make the base's motion of the laser's (W, 3)."""
    cos, sin = np.cos(turns) - 1.0, np.sin(turns)
    along = np.stack([-cos, sin, laser[:, 0], -laser[:, 1]], axis=1)
    across = np.stack([-sin, -cos, laser[:, 1], laser[:, 0]], axis=1)
    return np.stack([along, across], axis=1)


def _robust_solution(
    equations: NDArray[np.float64], targets: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The solution (4,) of equations (W, 2, 4) with targets (W, 2), and its covariance (4, 4)."""
    weights = np.ones(len(targets))
    for _ in range(_ROUNDS):
        weighted = equations * weights[:, None, None]
        hessian = np.einsum("wij,wik->jk", weighted, equations)
        left = targets - equations @ _solved(hessian, weighted, targets)
        missed = np.hypot(*left.T)
        noise = max(float(np.median(missed)), _MIN_NOISE)
        weights = 1.0 / (1.0 + (missed / (2.0 * noise)) ** 2)
    weighted = equations * weights[:, None, None]
    hessian = np.einsum("wij,wik->jk", weighted, equations)
    solution = _solved(hessian, weighted, targets)
    covariance: NDArray[np.float64] = noise**2 * np.linalg.inv(hessian + _prior())
    return solution, covariance


def _solved(
    hessian: NDArray[np.float64], weighted: NDArray[np.float64], targets: NDArray[np.float64]
) -> NDArray[np.float64]:
    right = np.einsum("wij,wi->j", weighted, targets)
    return np.linalg.solve(hessian + _prior(), right)


def _prior() -> NDArray[np.float64]:
    """(4, 4) information, in units of the noise, that the laser sits near the base's origin: without turns
    nothing else tells."""
    near = (_MIN_NOISE / _USUAL_DISTANCE) ** 2
    return np.diag([near, near, 1e-9, 1e-9])


def _right_angle(yaw: float) -> float:
    """The multiple of a right angle that is nearest."""
    return float(np.rint(yaw / (0.5 * np.pi)) * 0.5 * np.pi)
