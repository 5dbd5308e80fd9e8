"""Wheel odometry calibrated from the log itself: what it gets wrong by rule, and how far it can be trusted.

Wheels of unequal size turn a straight drive by so much per metre; a wrong track width scales every turn, a
wrong wheel radius every length. All three show against the motion that scan matching measured.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, wrap_angle

_ITERATIONS = 20
_MIN_STEPS = 20
_SIGMA_BOUNDS = (0.01, 0.3)
_TAIL = 0.8
_HEAVY_TAILS = 2.0
"""The errors of wheels are not Gaussian: their median tells a spread that the tail exceeds."""


@dataclass(frozen=True)
class OdometryCalibration:
    """Corrections and standard deviations per keyframe step."""

    turn_per_metre: float = 0.0
    """Radians of turn that the wheels miss per metre forward."""
    turn_scale: float = 1.0
    path_scale: float = 1.0
    sigma_distance: float = 0.05
    """Metres."""
    sigma_turn: float = 0.05
    """Radians."""
    tail_distance: float = 0.05
    """Metres that four steps in five err less than."""
    tail_turn: float = 0.05

    def correct(self, steps: Pose) -> Pose:
        """Odometry steps (..., 3) with the systematic errors taken out."""
        steps = np.asarray(steps, dtype=np.float64)
        forward = np.copysign(np.hypot(steps[..., 0], steps[..., 1]), steps[..., 0])
        turn = self.turn_per_metre * forward + self.turn_scale * steps[..., 2]
        corrected: Pose = self.path_scale * steps
        corrected[..., 2] = wrap_angle(turn)
        return corrected

    @property
    def worth(self) -> NDArray[np.float64]:
        """(3, 3) information of a corrected step of which nothing is known yet: it may be one of the bad
        ones."""
        return np.diag([self.tail_distance**-2.0, self.tail_distance**-2.0, self.tail_turn**-2.0])

    def information(self, surprise: Pose) -> NDArray[np.float64]:
        """(3, 3) of one corrected step that differs by ``surprise`` (3,) from what scan matching measured.

        Slipping wheels show in the directions that the scans observe, and are trusted no further than that;
        where the scans observe nothing there is no surprise, and odometry holds in full.
        """
        usual = np.array([self.sigma_distance, self.sigma_distance, self.sigma_turn])
        return np.diag(1.0 / np.maximum(usual, np.abs(surprise)) ** 2)


def calibrate(odometry_steps: Pose, matched_steps: Pose) -> OdometryCalibration:
    """Robust fit of odometry steps (N, 3) to the same steps as scan matching measured them (N, 3)."""
    if len(odometry_steps) < _MIN_STEPS:
        return OdometryCalibration()
    length = np.hypot(odometry_steps[:, 0], odometry_steps[:, 1])
    forward = np.copysign(length, odometry_steps[:, 0])
    turn_per_metre, turn_scale = _robust_fit(
        np.column_stack([forward, odometry_steps[:, 2]]), matched_steps[:, 2], np.array([0.0, 1.0])
    )
    along = np.sum(matched_steps[:, :2] * odometry_steps[:, :2], axis=1) / np.maximum(length, 1e-6)
    (path_scale,) = _robust_fit(length[:, None], along, np.array([1.0]))
    rough = OdometryCalibration(turn_per_metre, turn_scale, path_scale)
    error = matched_steps - rough.correct(odometry_steps)
    spreads = [_spread(error[:, :2]), _spread(wrap_angle(error[:, 2]))]
    return OdometryCalibration(
        turn_per_metre,
        turn_scale,
        path_scale,
        sigma_distance=spreads[0][0],
        sigma_turn=spreads[1][0],
        tail_distance=spreads[0][1],
        tail_turn=spreads[1][1],
    )


def _spread(error: NDArray[np.float64]) -> tuple[float, float]:
    """Standard deviation of the usual errors, and what four in five stay below."""
    usual = _HEAVY_TAILS * 1.4826 * np.median(np.abs(error))
    tail = max(usual, np.quantile(np.abs(error), _TAIL))
    low, high = _SIGMA_BOUNDS
    return float(np.clip(usual, low, high)), float(np.clip(tail, low, high))


def _robust_fit(
    design: NDArray[np.float64], observed: NDArray[np.float64], expected: NDArray[np.float64]
) -> tuple[float, ...]:
    """Least squares with Cauchy weights; a weak tie to ``expected`` decides what the data leave open."""
    tie = 0.05 * np.eye(design.shape[1])
    weight = np.ones(len(observed))
    solution = expected.copy()
    for _ in range(_ITERATIONS):
        normal = design.T @ (weight[:, None] * design) + tie
        solution[:] = np.linalg.solve(normal, design.T @ (weight * observed) + tie @ expected)
        residual = observed - design @ solution
        spread = 1.4826 * np.median(np.abs(residual)) + 1e-6
        weight = 1.0 / (1.0 + (residual / (2.0 * spread)) ** 2)
    return tuple(float(value) for value in solution)
