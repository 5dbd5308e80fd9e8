"""How much the car turns, by its wheels and its gyroscope, each weighed by what it has proven to be worth.

A gyroscope has a bias that drifts, and now and then other faults: it is dead, reports degrees, hangs upside
down, or is read so seldom that it loses turns. Wheels slip. Where the scans show the turn, both are compared
with it, segment after segment of the drive: the scale and the bias of the gyroscope follow from a robust fit,
and what both miss after that are their variances. Turns are fused by the inverse of these (the best linear
unbiased estimate of two independent measurements; Maybeck, Stochastic Models, Estimation, and Control, 1979,
section 1.5).
"""

from collections import deque
from dataclasses import dataclass, replace
from math import isnan, nan, radians
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecar.maps.geometry.se2 import Pose, wrap_angle

MAX_SCALE_ERROR = 0.15
"""Share by which the scale may be off: more is no gyroscope of this car, or one in other units or about
another axis. By judgement: data sheets allow 3 %; the rest is for turns that slow ones lose."""

FloatOrArray = TypeVar("FloatOrArray", float, NDArray[np.float64])

_ITERATIONS = 8
"""Of reweighted least squares: more than enough, because weights change little after the first few."""
_VARIANCE_PER_MEDIAN = 2.198
"""Variance of a Gaussian over the median of its squared deviations, by definition of its quantiles."""
_LOSS_WIDTH = 2.385
"""Width of the Cauchy loss in standard deviations, for 95 % efficiency on Gaussian errors (Holland and
Welsch, 1977)."""
_WORST = 5.0
"""Standard deviations as which a miss counts at most in a variance: slips count, but one lost scan among them
does not say all. By judgement, since nothing shows which is which."""
_SEGMENT_SECONDS = 1.0
"""Seconds of drive, at least, over which turns are compared, because over much less the jitter of single
scans hides what is compared."""
_SEGMENTS = 300
"""Segments that are remembered. By judgement: some minutes of driving, over which a bias stays what it is."""
_MEMORY = 150.0
"""Segments after which one counts a third, since the bias drifts as the chip warms."""
_SCAN_NOISE = 0.005
"""Standard deviation, in radians, of a turn that scans show, as two matched headings have it. By judgement:
0.2° each, which laser scans of a room reach."""
_BIAS_SIGMA = 0.1
"""Standard deviation of a gyroscope's bias, rad/s, before it is learned. By judgement: 6 °/s; the data sheet
of the MPU-6050 allows 20 °/s, most are far below."""
_SCALE_SIGMA = 0.3
"""Standard deviation of a gyroscope's scale before it is learned. Chosen by judgement: so wide that
degrees and a wrong sign show as such."""
_KNOWN_SCALE = 0.05
"""Largest standard deviation of the scale with which a gyroscope that was tried is believed, since one that
stays at rest while the car turns leaves it unknown."""
_UNSEEN_TURN = 0.2
"""Radians, beyond what a bias makes, that the gyroscope must have turned while wheels that never reported the
least turn reported none, so that they do not know turns."""
_TURN_UNTIL_TRIED = 2.0
"""Radians that the car must have turned, to and fro, until the gyroscope counts as tried. By judgement: a
bend or two."""
_MIN_SEGMENTS = 5
"""Segments until the gyroscope may count as tried, since a spread of fewer says little."""
_METRE_EXPOSURE = 0.3
"""Radians of turn that put wheels to as much of a test as a metre of driving. By judgement: calibrated wheels
err by some per cent of a turn and by a degree in some metres."""
_STANDING_EXPOSURE = 1e-6
"""The same of a second in which the wheels stand: next to nothing, since a car that stands does not turn;
wheels that stand while the car turns are found out by it at once."""
_SECOND_EXPOSURE = 0.1
"""Radians of turn that put a gyroscope to as much of a test as a second, because it errs by per cents of a
turn, and by what is left of its bias."""
_MIN_VARIANCE = 1e-6
"""Least variance of a turn, square radians per radian of exposure, since no comparison shows less: 0.06°
after a radian."""


@dataclass(frozen=True)
class TurnModel:
    """What is known of wheels and gyroscope; replaced as a whole, so that any thread may read it."""

    is_believed: bool = False
    """Whether the gyroscope has proven to measure the turns of this car."""
    is_contradicted: bool = False
    """Whether it has proven not to."""
    scale: float = 1.0
    """Of the turns that the gyroscope reports, the factor to true ones."""
    bias: float = 0.0
    """Radians per second that are left to subtract after that."""
    gyro_variance: float = 0.01
    """Square radians per radian of exposure; at first by judgement, because nothing is known."""
    wheel_variance: float = nan
    wheels_are_blind: bool = False
    """Whether they report not the least turn, however the gyroscope turns."""
    agrees_with_wheels: bool = False
    """Whether the gyroscope turns as far as the wheels do."""

    @property
    def is_used(self) -> bool:
        """Whether the turns of the gyroscope count: proven, or the only ones and not refuted."""
        return self.is_believed or (self.wheels_are_blind and not self.is_contradicted)

    @property
    def figures(self) -> dict[str, float | bool]:
        """What was learned, for reports: angles in radians, variances per radian of exposure."""
        return {
            "is_used": self.is_used,
            "scale": self.scale,
            "bias": self.bias,
            "variance": self.gyro_variance,
            "variance_of_wheels": self.wheel_variance,
        }

    @property
    def contradiction(self) -> str | None:
        """What is wrong with a gyroscope that the scans contradict, as a sentence for people."""
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
        """What to do about the contradiction, as a sentence for people."""
        if self._scales_by(-1.0) or self._scales_by(radians(1.0)):
            return "Correct the driver, or publish where the IMU sits on /tf_static."
        if self.agrees_with_wheels:
            return "Correct angle_min, angle_max and angle_increment in the laser's driver."
        return (
            "Make sure that its driver reports radians per second about the axis that points up, or leave "
            "it out with --no-imu."
        )

    def _scales_by(self, plain: float) -> bool:
        return abs(self.scale / plain - 1.0) < MAX_SCALE_ERROR

    def by_gyro(self, gyro_turn: FloatOrArray, seconds: FloatOrArray) -> FloatOrArray:
        """The turn in so many seconds, from what the gyroscope measured."""
        return self.scale * gyro_turn - self.bias * seconds

    def variance_by_gyro(self, turn: float, seconds: float) -> float:
        """Square radians by which that errs."""
        return self.gyro_variance * _gyro_exposure(turn, seconds)

    def fused(self, steps: Pose, gyro_turns: ArrayLike, seconds: ArrayLike) -> Pose:
        """Steps (..., 3) of the base by its wheels, with the turns that wheels and gyroscope measured.

        ``gyro_turns`` (...) are as measured, NaN where it did not, and so many ``seconds`` (...) passed.
        """
        if not self.is_used:
            return steps
        fused = np.array(steps, dtype=np.float64)
        by_gyro = self.by_gyro(np.asarray(gyro_turns), np.asarray(seconds))
        gained = (1.0 - self.wheel_share(steps, by_gyro, seconds)) * wrap_angle(by_gyro - fused[..., 2])
        return turned_more(fused, np.where(np.isnan(gained), 0.0, gained))

    def wheel_share(self, steps: Pose, turns_by_gyro: ArrayLike, seconds: ArrayLike) -> NDArray[np.float64]:
        """Weights (...) of what the wheels say of the turn in steps (..., 3), 0 to 1."""
        if self.wheels_are_blind:
            return np.zeros(np.shape(turns_by_gyro))
        seconds, turns_by_gyro = np.asarray(seconds), np.asarray(turns_by_gyro)
        distances = np.hypot(steps[..., 0], steps[..., 1])
        wheels = self.wheel_variance * _wheel_exposure(steps[..., 2], distances, seconds)
        gyro = self.gyro_variance * _gyro_exposure(turns_by_gyro, seconds)
        share: NDArray[np.float64] = gyro / np.maximum(gyro + wheels, 1e-30)
        return np.where(np.isnan(share), 0.0, share)


def turned_more(steps: Pose, turns: ArrayLike) -> Pose:
    """Steps (..., 3) of a car that turned by so many radians (...) more.

    It is taken to have gone along an arc, whose chord deviates from its start by half the turn.
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
        """(5,) each: seconds; turn by the scans, by the gyroscope and by the wheels; metres by the wheels.
        The last two are NaN where these were silent."""
        self._segment = np.zeros(5)
        self._unseen_turn = 0.0
        """Radians by the gyroscope of which the wheels reported nothing; -inf once they reported any."""

    def start_anew(self) -> None:
        """The next turn does not continue the last one."""
        self._segment = np.zeros(5)

    def watch(self, wheel_step: Pose, gyro_turn: float, seconds: float) -> None:
        """Take in a step (3,) by the wheels as it is: some drivers know distances only."""
        if wheel_step[2] != 0.0:
            self._unseen_turn = -np.inf
        elif not isnan(gyro_turn):
            self._unseen_turn += max(abs(gyro_turn) - _BIAS_SIGMA * seconds, 0.0)
        are_blind = self._unseen_turn > _UNSEEN_TURN
        if are_blind != self.model.wheels_are_blind:
            self.model = replace(self.model, wheels_are_blind=are_blind)

    def follow(self, seconds: float, turn: float, gyro_turn: float, wheel_step: Pose | None) -> None:
        """Take in a step of so many seconds, in which the scans show a ``turn`` in radians.

        ``gyro_turn`` is as measured, NaN where it did not; ``wheel_step`` (3,) without the systematic errors.
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
    """Radians (...) to which errors of a gyroscope are proportional."""
    return abs(turns) + _SECOND_EXPOSURE * seconds


def _wheel_exposure(
    turns: NDArray[np.float64], metres: NDArray[np.float64], seconds: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Radians (...) to which errors of wheels are proportional."""
    return np.abs(turns) + _METRE_EXPOSURE * metres + _STANDING_EXPOSURE * seconds


def _are_alike(turns: NDArray[np.float64], others: NDArray[np.float64]) -> bool:
    """Whether turns (N,) in radians explain most of the others (N,), at the same scale."""
    return bool(np.abs(turns - others).sum() < MAX_SCALE_ERROR * np.abs(others).sum())


def _variance(
    missed: NDArray[np.float64], exposure: NDArray[np.float64], weights: NDArray[np.float64]
) -> float:
    """Square radians per exposure (N,), of turns that missed those of the scans by so many radians (N,).

    The mean of squares without what the scans' own noise makes, in which no miss counts as more than some
    standard deviations that the median shows.
    """
    if len(missed) == 0:
        return nan
    noise, squares = _SCAN_NOISE**2, missed**2
    usual = max(float(np.median((_VARIANCE_PER_MEDIAN * squares - noise) / exposure)), _MIN_VARIANCE)
    counted = np.minimum(squares, _WORST**2 * (noise + usual * exposure))
    seen = float(np.sum(weights * (counted - noise)) / np.sum(weights * exposure))
    return max(seen, _MIN_VARIANCE)
