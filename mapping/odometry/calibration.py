"""Wheel odometry calibrated from the log itself: its systematic errors, and how far it can be trusted.

Wheels of unequal size turn a straight drive by so much per metre; a wrong track width scales every turn, a
wrong wheel radius every length. All three show against the motion that scan matching measured.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.odometry.config import WheelCalibrationConfig
from racecar.maps.geometry.se2 import Pose, wrap_angle

_ITERATIONS = 20
"""Of reweighted least squares: more than enough, because the weights change little after the first few."""
_SIGMA_PER_MEDIAN = 1.4826
"""Standard deviation of a Gaussian over the median of its absolute deviations, by definition of its
quantiles."""
_SMALLEST = 1e-6
"""Metres or radians, so that nothing is divided by zero where the car stood or the fit is perfect."""


@dataclass(frozen=True)
class WheelCalibration:
    """Corrections and standard deviations per keyframe step."""

    turn_per_metre: float
    """Radians of turn that the wheels miss per metre forward."""
    turn_scale: float
    path_scale: float
    sigma_distance: float
    """Metres."""
    sigma_turn: float
    """Radians."""
    tail_distance: float
    """Metres that most steps err less than."""
    tail_turn: float
    """Radians, likewise."""

    @classmethod
    def unknown(cls, config: WheelCalibrationConfig) -> "WheelCalibration":
        """Wheels as they are, while nothing is known about them."""
        return cls(0.0, 1.0, 1.0, *[config.initial_sigma] * 4)

    def correct(self, steps: Pose) -> Pose:
        """Odometry steps (..., 3) without the systematic errors."""
        return _corrected(steps, self.turn_per_metre, self.turn_scale, self.path_scale)

    @property
    def worth(self) -> NDArray[np.float64]:
        """(3, 3) information of a corrected step before scans were matched: it may be one of the bad ones."""
        return np.diag([self.tail_distance**-2.0, self.tail_distance**-2.0, self.tail_turn**-2.0])

    def information(self, surprise: Pose) -> NDArray[np.float64]:
        """(3, 3) of one corrected step that differs by ``surprise`` (3,) from what scan matching measured.

        Slip shows in the directions that the scans observe, and wheels are trusted no further than that;
        where the scans observe nothing there is no surprise, and odometry holds in full.
        """
        usual = np.array([self.sigma_distance, self.sigma_distance, self.sigma_turn])
        return np.diag(1.0 / np.maximum(usual, np.abs(surprise)) ** 2)


def calibrate(
    odometry_steps: Pose,
    matched_steps: Pose,
    config: WheelCalibrationConfig,
    fused: Callable[[Pose], Pose] = lambda corrected: corrected,
) -> WheelCalibration:
    """Robust fit of odometry steps (N, 3) to the same steps as scan matching measured them (N, 3).

    What is left of errors is that of the corrected steps after a gyroscope was ``fused`` with them.
    """
    if len(odometry_steps) < config.min_steps:
        return WheelCalibration.unknown(config)
    length = np.hypot(odometry_steps[:, 0], odometry_steps[:, 1])
    forward = np.copysign(length, odometry_steps[:, 0])
    design = np.column_stack([forward, odometry_steps[:, 2]])
    turn_per_metre, turn_scale = _robust_fit(design, matched_steps[:, 2], np.array([0.0, 1.0]), config)
    along = np.sum(matched_steps[:, :2] * odometry_steps[:, :2], axis=1) / np.maximum(length, _SMALLEST)
    (path_scale,) = _robust_fit(length[:, None], along, np.array([1.0]), config)
    error = matched_steps - fused(_corrected(odometry_steps, turn_per_metre, turn_scale, path_scale))
    sigma_distance, tail_distance = _spread(error[:, :2], config)
    sigma_turn, tail_turn = _spread(wrap_angle(error[:, 2]), config)
    return WheelCalibration(
        turn_per_metre, turn_scale, path_scale, sigma_distance, sigma_turn, tail_distance, tail_turn
    )


def _corrected(steps: Pose, turn_per_metre: float, turn_scale: float, path_scale: float) -> Pose:
    steps = np.asarray(steps, dtype=np.float64)
    forward = np.copysign(np.hypot(steps[..., 0], steps[..., 1]), steps[..., 0])
    turn = turn_per_metre * forward + turn_scale * steps[..., 2]
    corrected: Pose = path_scale * steps
    corrected[..., 2] = wrap_angle(turn)
    return corrected


def _spread(error: NDArray[np.float64], config: WheelCalibrationConfig) -> tuple[float, float]:
    """Standard deviation of the usual errors, and what most stay below."""
    usual = config.heavy_tails * _SIGMA_PER_MEDIAN * np.median(np.abs(error))
    tail = max(usual, np.quantile(np.abs(error), config.tail_share))
    low, high = config.min_sigma, config.max_sigma
    return float(np.clip(usual, low, high)), float(np.clip(tail, low, high))


def _robust_fit(
    design: NDArray[np.float64],
    observed: NDArray[np.float64],
    expected: NDArray[np.float64],
    config: WheelCalibrationConfig,
) -> tuple[float, ...]:
    """Least squares with Cauchy weights; a weak prior at ``expected`` decides what the data leave open."""
    prior = config.prior_weight * np.eye(design.shape[1])
    weight = np.ones(len(observed))
    solution = expected.copy()
    for _ in range(_ITERATIONS):
        normal = design.T @ (weight[:, None] * design) + prior
        solution[:] = np.linalg.solve(normal, design.T @ (weight * observed) + prior @ expected)
        residual = observed - design @ solution
        spread = _SIGMA_PER_MEDIAN * np.median(np.abs(residual)) + _SMALLEST
        weight = 1.0 / (1.0 + (residual / (config.loss_width * spread)) ** 2)
    return tuple(float(value) for value in solution)
