"""Fuses the turns measured by wheels and gyroscope, each weighted by its proven accuracy.

A gyroscope has a drifting bias, and sometimes other faults: it is dead, reports degrees, is mounted upside
down, or is read so rarely that it misses turns. Wheels slip. Where the scans show the turn, both are compared
with it, segment by segment. A robust fit yields the scale and bias of the gyroscope; the remaining errors of
both are their variances. Turns are fused by inverse variance (the best linear unbiased estimate of two
independent measurements; Maybeck, Stochastic Models, Estimation, and Control, 1979, section 1.5).
"""

from collections import deque
from dataclasses import dataclass, replace
from math import isnan, nan, radians
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecar.maps.geometry.se2 import Pose, wrap_angle
from racecar.sensors.findings import Finding

MAX_SCALE_ERROR = 0.15
"""Maximum relative error of the scale. More means a gyroscope of another device, in other units or about
another axis. Chosen by judgement: data sheets allow 3 %; the rest is for turns that slow ones miss."""

FloatOrArray = TypeVar("FloatOrArray", float, NDArray[np.float64])

_ITERATIONS = 8
"""Reweighted least squares iterations: ample, because weights change little after the first few."""
_VARIANCE_PER_MEDIAN = 2.198
"""Ratio of a Gaussian's variance to its median squared deviation, by definition of its quantiles."""
_LOSS_WIDTH = 2.385
"""Width of the Cauchy loss in standard deviations, for 95 % efficiency on Gaussian errors (Holland and
Welsch, 1977)."""
_WORST = 5.0
"""Standard deviations at which an error is capped in a variance: slip counts, but a single lost scan does not
dominate. Chosen by judgement, since nothing distinguishes the two."""
_SEGMENT_SECONDS = 1.0
"""Minimum seconds of drive over which turns are compared, because over much less the jitter of single scans
hides the difference."""
_SEGMENTS = 300
"""Segments kept. Chosen by judgement: a few minutes of driving, over which a bias stays constant."""
_MEMORY = 150.0
"""Segments after which the weight of one falls to a third, since the bias drifts as the chip warms up."""
_SCAN_NOISE = 0.005
"""Standard deviation, in radians, of a turn between two matched headings. Chosen by judgement: 0.2° each,
which laser scans of a room reach."""
_BIAS_SIGMA = 0.1
"""Prior standard deviation of a gyroscope's bias, rad/s. Chosen by judgement: 6 °/s; the data sheet of the
MPU-6050 allows 20 °/s, most are far below."""
_SCALE_SIGMA = 0.3
"""Prior standard deviation of a gyroscope's scale. Chosen by judgement: wide enough to recognize degrees and
a wrong sign."""
_KNOWN_SCALE = 0.05
"""Largest standard deviation of the scale at which a tested gyroscope is trusted, since one that reports no
motion while the car turns leaves it unknown."""
_UNSEEN_TURN = 0.2
"""Radians in excess of any bias that the gyroscope must turn while the wheels report none. Wheels that have
never reported a turn are then ignored for turns, since they cannot measure them."""
_TURN_UNTIL_TRIED = 2.0
"""Radians of absolute turn after which the gyroscope counts as tested. Chosen by judgement: a bend or two."""
_MIN_SEGMENTS = 5
"""Minimum number of segments for a tested gyroscope, since the spread of fewer is not meaningful."""
_METRE_EXPOSURE = 0.3
"""Radians of turn that cause the same wheel error as a metre of driving. Chosen by judgement: calibrated
wheels err by some per cent of a turn and by a degree in several metres."""
_STANDING_EXPOSURE = 1e-6
"""The same for a second in which the wheels stand: almost zero, since a standing car does not turn. Wheels
that stand while the car turns are detected by it at once."""
_SECOND_EXPOSURE = 0.1
"""Radians of turn that cause the same gyroscope error as a second, because it errs by per cents of a turn,
and by its remaining bias."""
_MIN_VARIANCE = 1e-6
"""Least variance of a turn, square radians per radian of exposure, since no comparison is more precise: 0.06°
after a radian."""


@dataclass(frozen=True)
class TurnModel:
    """State of wheels and gyroscope; replaced as a whole, so that any thread may read it."""

    is_believed: bool = False
    """Whether the gyroscope has proven to measure this car's turns."""
    is_contradicted: bool = False
    """Whether it has proven not to."""
    scale: float = 1.0
    """Factor from reported to true turns of the gyroscope."""
    bias: float = 0.0
    """Radians per second to subtract after scaling."""
    gyro_variance: float = 0.01
    """Square radians per radian of exposure. The initial value is chosen by judgement."""
    wheel_variance: float = nan
    wheels_are_blind: bool = False
    """Whether the wheels report no turn at all, however much the gyroscope turns."""
    agrees_with_wheels: bool = False
    """Whether the gyroscope turns as much as the wheels do."""

    @property
    def is_used(self) -> bool:
        """Whether the gyroscope's turns are used: proven, or the only ones and not refuted."""
        return self.is_believed or (self.wheels_are_blind and not self.is_contradicted)

    @property
    def figures(self) -> dict[str, float | bool]:
        """The learned values for reports: angles in radians, variances per radian of exposure."""
        return {
            "is_used": self.is_used,
            "scale": self.scale,
            "bias": self.bias,
            "variance": self.gyro_variance,
            "variance_of_wheels": self.wheel_variance,
        }

    @property
    def contradiction(self) -> str | None:
        """What is wrong with a gyroscope that the scans contradict, as a sentence for the user."""
        if not self.is_contradicted:
            return None
        if self._scales_by(-1.0):
            what = "turns to the other side: it hangs upside down, and no transform says so"
        elif self._scales_by(radians(1.0)):
            what = "reports degrees instead of radians per second"
        elif self.agrees_with_wheels:
            return (
                f"The scans turn {self.scale:.2f} times as far as wheels and gyroscope, which agree with "
                "each other; the gyroscope was not used."
            )
        else:
            what = "does not turn as they do"
        return f"By the scans the gyroscope of the IMU {what}; it was not used."

    @property
    def remedy(self) -> str:
        """How to fix the contradiction, as a sentence for the user."""
        if self._scales_by(-1.0) or self._scales_by(radians(1.0)):
            return "Correct the driver, or publish where the IMU sits on /tf_static."
        if self.agrees_with_wheels:
            return "Correct angle_min, angle_max and angle_increment in the laser's driver."
        return (
            "Make sure that its driver reports radians per second about the axis that points up, or leave "
            "it out (parameter use_imu, flag --no-imu; live by remapping imu)."
        )

    @property
    def finding(self) -> Finding | None:
        """What is wrong and its remedy; None if the scans do not contradict the gyroscope."""
        why = self.contradiction
        return (
            None if why is None else Finding("gyroscope_contradicts", contradiction=why, remedy=self.remedy)
        )

    def _scales_by(self, plain: float) -> bool:
        return abs(self.scale / plain - 1.0) < MAX_SCALE_ERROR

    def by_gyro(self, gyro_turn: FloatOrArray, seconds: FloatOrArray) -> FloatOrArray:
        """The turn over ``seconds``, from the measurement of the gyroscope."""
        return self.scale * gyro_turn - self.bias * seconds

    def variance_by_gyro(self, turn: float, seconds: float) -> float:
        """Variance of that turn in square radians."""
        return self.gyro_variance * _gyro_exposure(turn, seconds)

    def fused(self, steps: Pose, gyro_turns: ArrayLike, seconds: ArrayLike) -> Pose:
        """Wheel steps (..., 3) of the base, with the turns of wheels and gyroscope fused.

        ``gyro_turns`` (...) are as measured, NaN if missing; the steps took ``seconds`` (...).
        """
        if not self.is_used:
            return steps
        fused = np.array(steps, dtype=np.float64)
        by_gyro = self.by_gyro(np.asarray(gyro_turns), np.asarray(seconds))
        gained = (1.0 - self.wheel_share(steps, by_gyro, seconds)) * wrap_angle(by_gyro - fused[..., 2])
        return turned_more(fused, np.where(np.isnan(gained), 0.0, gained))

    def wheel_share(self, steps: Pose, turns_by_gyro: ArrayLike, seconds: ArrayLike) -> NDArray[np.float64]:
        """Weights (...) of the wheels, 0 to 1, in the turn of steps (..., 3)."""
        if self.wheels_are_blind:
            return np.zeros(np.shape(turns_by_gyro))
        seconds, turns_by_gyro = np.asarray(seconds), np.asarray(turns_by_gyro)
        distances = np.hypot(steps[..., 0], steps[..., 1])
        wheels = self.wheel_variance * _wheel_exposure(steps[..., 2], distances, seconds)
        gyro = self.gyro_variance * _gyro_exposure(turns_by_gyro, seconds)
        share: NDArray[np.float64] = gyro / np.maximum(gyro + wheels, 1e-30)
        return np.where(np.isnan(share), 0.0, share)


def turned_more(steps: Pose, turns: ArrayLike) -> Pose:
    """Steps (..., 3) of a car that turned by additional radians (...).

    The car is assumed to follow an arc, whose chord deviates from its start by half the turn.
    """
    turns = np.asarray(turns)
    cos, sin = np.cos(0.5 * turns), np.sin(0.5 * turns)
    x, y, turn = np.moveaxis(np.asarray(steps, dtype=np.float64), -1, 0)
    return np.stack([cos * x - sin * y, sin * x + cos * y, wrap_angle(turn + turns)], axis=-1)


class TurnFusion:
    """Learns the `TurnModel` while the car drives."""

    def __init__(self) -> None:
        self.model = TurnModel()
        self._segments: deque[NDArray[np.float64]] = deque(maxlen=_SEGMENTS)
        """(5,) each: seconds; turns by scans, gyroscope and wheels; metres by the wheels. The last two are
        NaN if these did not report."""
        self._segment = np.zeros(5)
        self._unseen_turn = 0.0
        """Radians by the gyroscope while the wheels reported none; -inf once they have reported any."""

    def start_anew(self) -> None:
        """Start a new segment: the next turn does not continue the last one."""
        self._segment = np.zeros(5)

    def watch(self, wheel_step: Pose, gyro_turn: float, seconds: float) -> None:
        """Add a raw wheel step (3,), to detect drivers that report distances only."""
        if wheel_step[2] != 0.0:
            self._unseen_turn = -np.inf
        elif not isnan(gyro_turn):
            self._unseen_turn += max(abs(gyro_turn) - _BIAS_SIGMA * seconds, 0.0)
        are_blind = self._unseen_turn > _UNSEEN_TURN
        if are_blind != self.model.wheels_are_blind:
            self.model = replace(self.model, wheels_are_blind=are_blind)

    def follow(self, seconds: float, turn: float, gyro_turn: float, wheel_step: Pose | None) -> None:
        """Add a step of this many seconds, in which the scans show a ``turn`` in radians.

        ``gyro_turn`` is as measured, NaN if missing; ``wheel_step`` (3,) without the systematic errors.
        """
        if isnan(gyro_turn) or not 0.0 < seconds < np.inf:
            self.start_anew()
            return
        by_wheels = (
            (nan, nan) if wheel_step is None else (float(wheel_step[2]), float(np.hypot(*wheel_step[:2])))
        )
        self._segment = self._segment + np.array([seconds, turn, gyro_turn, *by_wheels])
        if self._segment[0] >= _SEGMENT_SECONDS:
            self._segments.append(self._segment)
            self.start_anew()
            self._learn()

    def _learn(self) -> None:
        segments = np.array(self._segments)
        seconds, turns, by_gyro, by_wheels, metres = segments.T
        ages = np.arange(len(segments))[::-1]
        memory = np.exp(-ages / _MEMORY)
        design = np.column_stack([by_gyro, -seconds])
        prior, expected = np.diag([_SCALE_SIGMA**-2.0, _BIAS_SIGMA**-2.0]), np.array([1.0, 0.0])
        solution, per_exposure = expected, _MIN_VARIANCE
        weights = memory
        covariance = np.zeros((2, 2))
        for _ in range(_ITERATIONS):
            exposure = _gyro_exposure(design @ solution, seconds)
            variances = _SCAN_NOISE**2 + per_exposure * exposure
            covariance = np.linalg.inv(design.T @ ((weights / variances)[:, None] * design) + prior)
            solution = covariance @ (design.T @ (weights / variances * turns) + prior @ expected)
            missed = turns - design @ solution
            per_exposure = _variance(missed, exposure, memory)
            variances = _SCAN_NOISE**2 + per_exposure * exposure
            weights = memory / (1.0 + missed**2 / (_LOSS_WIDTH**2 * variances))
        scale, bias = solution.tolist()
        is_tried = len(segments) >= _MIN_SEGMENTS and np.abs(turns).sum() > _TURN_UNTIL_TRIED
        is_known = covariance[0, 0] < _KNOWN_SCALE**2
        is_right = is_known and abs(scale - 1.0) < MAX_SCALE_ERROR
        known = ~np.isnan(by_wheels)
        exposure = _wheel_exposure(by_wheels[known], metres[known], seconds[known])
        wheels = _variance(turns[known] - by_wheels[known], exposure, memory[known])
        self.model = TurnModel(
            is_tried and is_right,
            is_tried and not is_right,
            scale,
            bias,
            per_exposure,
            wheels,
            self.model.wheels_are_blind,
            _are_alike(by_gyro[known], by_wheels[known]),
        )


def _gyro_exposure(turns: FloatOrArray, seconds: FloatOrArray) -> FloatOrArray:
    """Radians (...) that the errors of a gyroscope are proportional to."""
    return abs(turns) + _SECOND_EXPOSURE * seconds


def _wheel_exposure(
    turns: NDArray[np.float64], metres: NDArray[np.float64], seconds: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Radians (...) that the errors of wheels are proportional to."""
    return np.abs(turns) + _METRE_EXPOSURE * metres + _STANDING_EXPOSURE * seconds


def _are_alike(turns: NDArray[np.float64], others: NDArray[np.float64]) -> bool:
    """Whether turns (N,) in radians explain most of the others (N,), at the same scale."""
    return bool(np.abs(turns - others).sum() < MAX_SCALE_ERROR * np.abs(others).sum())


def _variance(
    missed: NDArray[np.float64], exposure: NDArray[np.float64], weights: NDArray[np.float64]
) -> float:
    """Square radians per exposure (N,), of turns that ``missed`` those of the scans by radians (N,).

    The mean square error minus the scans' own noise, with each error capped at some standard deviations as
    estimated from the median.
    """
    if len(missed) == 0:
        return nan
    noise, squares = _SCAN_NOISE**2, missed**2
    usual = max(float(np.median((_VARIANCE_PER_MEDIAN * squares - noise) / exposure)), _MIN_VARIANCE)
    counted = np.minimum(squares, _WORST**2 * (noise + usual * exposure))
    seen = float(np.sum(weights * (counted - noise)) / np.sum(weights * exposure))
    return max(seen, _MIN_VARIANCE)
