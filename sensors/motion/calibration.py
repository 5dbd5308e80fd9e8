"""Calibrates wheel odometry from the log itself: its systematic errors, and how far it can be trusted.

All three `OdometryFaults` show up against the motion that scan matching measured over spans of several steps.
Errors that grow with the length of a span come from the wheels. Scan matches err too, for instance when a
tilted laser sees the ground, but no more over a long span than over a short one.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from racecar.maps.geometry.se2 import Pose, between, chained, wrap_angle
from racecar.sensors.motion.odometry_faults import OdometryFaults, forward

_ITERATIONS = 20
"""Maximum number of reweighted least squares iterations. Measured: with 8 a simulated campus was off by 0.15
m instead of 0.07 m."""
_SETTLED = 1e-5
"""The fit has converged once an iteration changes each parameter by less than this share of its usual size.
Chosen by judgement: far more precise than a fault can be known."""
SIGMA_PER_MEDIAN = 1.4826
"""Ratio of a Gaussian's standard deviation to its median absolute deviation, by definition of its
quantiles."""
_TELLING_TURN = 0.15
"""Radians of turn above which a span constrains the scale of turns. On straights the wheels' turns are mere
noise. Regressing on noise (errors in variables) gives honest wheels a scale of 0.2 to 0.7 on open ground,
where matches then follow the wheels so corrected. Measured: wheels with a random error of 3 mrad a step still
seem to turn 17 % too far with 0.1, and 9 % with 0.15."""
_GAINS = 0.4, 2.5
"""Bounds on the scale of distances and turns. Chosen by judgement: a radius entered as the diameter, plus
some room. Anything beyond that is not the wheels' fault."""
_SMALLEST = 1e-6
"""Metres or radians, so that nothing is divided by zero where the car stood or the fit is perfect."""
_MIN_SPANS = 40
"""Minimum number of spans for a fit. Chosen by judgement: those of about ten steps."""
_MIN_REACH = 0.1
"""Metres of a span that shows the path's scale. Chosen by judgement: a few times the error of a match."""
_SPANS_PER_STEP = 8.0
"""Number of spans that contain each step, since each keyframe is matched with this many others. Dividing by
it counts each step once."""
_INITIAL_SIGMA = 0.05
"""Standard deviation of a step, metres and radians, before anything is fitted. Chosen by judgement: typical
of uncalibrated wheels."""
_INITIAL_STEP = 0.3
"""Metres of a usual step before anything is fitted, since keyframes are usually this far apart."""
_TURN_PER_METRE_SIGMA = 0.02
"""Typical drift of the wheels' heading, radians per metre. Measured: up to 0.06 on aces, fr079 and intel."""
_SCALE_SIGMA = 0.1
"""Typical relative error of turns and distances. Measured on recordings: 2 to 5 %; doubled, since a wheel of
another size is not rare. With 0.05, wheels that were off by 13 % on simulated open ground were corrected by
too little."""
_BIAS_TURN_SIGMA = 0.003
"""Typical bias of a match, radians. Measured with ground returns outdoors: 0.0007."""
_BIAS_DISTANCE_SIGMA = 0.01
"""Typical bias of a match, metres. Chosen by judgement: the range error of a laser."""
_SIGMAS = 0.01, 0.3
"""Bounds on the standard deviation of a step, metres and radians. Chosen by judgement: the error of a scan
match, and a whole keyframe step."""
_TAIL_SHARE = 0.8
"""Quantile of the steps' errors used as their standard deviation before scans are matched, since the step may
be one of the bad ones."""
_LOSS_WIDTH = 2.0
"""Width of the Cauchy loss, in standard deviations of the residuals. 95 % efficiency on Gaussian errors is at
2.385 (Holland and Welsch, 1977). Chosen by judgement: a little less."""


@dataclass(frozen=True)
class WheelCalibration:
    """Corrections and standard deviations per keyframe step; the defaults describe wheels before anything is
    known."""

    faults: OdometryFaults = field(default_factory=OdometryFaults)
    sigma_distance: float = _INITIAL_SIGMA
    """Metres."""
    sigma_turn: float = _INITIAL_SIGMA
    """Radians."""
    tail_distance: float = _INITIAL_SIGMA
    """Metres; most steps err by less."""
    tail_turn: float = _INITIAL_SIGMA
    """Radians; most steps err by less."""
    usual_step: float = _INITIAL_STEP
    """Metres of the steps that these errors refer to; longer steps err by more."""

    def prior(self, step: Pose) -> NDArray[np.float64]:
        """(3, 3) information of a corrected ``step`` (3,) before scans are matched: it may be one of the bad
        ones."""
        return self._information(step, self.tail_distance, self.tail_turn)

    def information(self, step: Pose) -> NDArray[np.float64]:
        """(3, 3) information of a corrected ``step`` (3,)."""
        return self._information(step, self.sigma_distance, self.sigma_turn)

    def _information(self, step: Pose, distance: float, turn: float) -> NDArray[np.float64]:
        """From the deviations of a usual step; errors of longer steps accumulate as a random walk."""
        usual_steps = max(1.0, float(np.hypot(step[0], step[1])) / self.usual_step)
        return np.diag([distance**-2.0, distance**-2.0, turn**-2.0]) / usual_steps


@dataclass(frozen=True, eq=False)
class MatchedSpans:
    """M motions, each over several consecutive steps, as measured by scan matching."""

    first: NDArray[np.int64]
    """(M,) first step of each span."""
    end: NDArray[np.int64]
    """(M,) one past the last step of each span."""
    motions: Pose
    """(M, 3)"""
    information: NDArray[np.float64]
    """(M, 3, 3)"""

    @property
    def lengths(self) -> NDArray[np.int64]:
        """(M,) number of steps."""
        return self.end - self.first

    def are_over(self, steps: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(M,) whether each span contains any of the marked steps (N,)."""
        until = np.concatenate([[0], np.cumsum(steps)])
        return np.asarray(until[self.end] > until[self.first])

    def chosen(self, which: NDArray[np.bool_]) -> "MatchedSpans":
        """The spans selected by a mask (M,)."""
        return MatchedSpans(self.first[which], self.end[which], self.motions[which], self.information[which])

    def variances_along(self, towards: NDArray[np.float64]) -> NDArray[np.float64]:
        """(M,) variances of the motions along directions (M, 3): along a bare corridor a match adds nothing
        to its initial guess."""
        variances: NDArray[np.float64] = np.einsum("mi,mij,mj->m", towards, self._covariance, towards)
        return variances

    @cached_property
    def _covariance(self) -> NDArray[np.float64]:
        """(M, 3, 3)"""
        return np.asarray(np.linalg.inv(self.information), dtype=np.float64)


def calibrate(
    steps: Pose, spans: MatchedSpans, fused: Callable[[Pose], Pose] = lambda corrected: corrected
) -> WheelCalibration:
    """Robust fit of odometry steps (N, 3), NaN where missing, to the motion over spans of them.

    The remaining errors are those of the corrected steps after ``fused`` has added a gyroscope to them.
    """
    spans = spans.chosen(~spans.are_over(np.isnan(steps[:, 0])))
    if len(spans.lengths) < _MIN_SPANS:
        return WheelCalibration()
    steps = np.nan_to_num(steps)
    (trim, turn_off, _), sigma_turn = _fit_turns(steps, spans)
    faults = OdometryFaults(turn=_believed(turn_off), trim=trim)
    chain = chained(fused(faults.corrected(steps)))
    by_wheels = between(chain[spans.first], chain[spans.end])
    reach = np.hypot(by_wheels[:, 0], by_wheels[:, 1])
    towards = np.column_stack(
        [by_wheels[:, :2] / np.maximum(reach, _SMALLEST)[:, None], np.zeros(len(reach))]
    )
    along, told = np.sum(spans.motions * towards, axis=1), spans.variances_along(towards)
    moved = reach > _MIN_REACH
    (path_off, _), sigma_distance = _fit_path(
        reach[moved], along[moved], by_wheels[moved, 0], told[moved], spans.lengths[moved]
    )
    faults = replace(faults, distance=_believed(path_off))
    scale = 1.0 + faults.distance
    error = between(by_wheels * [scale, scale, 1.0], spans.motions)
    single, tell = spans.lengths == 1, moved & (told < _INITIAL_SIGMA**2)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    driven = lengths[lengths > _MIN_REACH]
    return WheelCalibration(
        faults,
        _clipped(sigma_distance),
        _clipped(sigma_turn),
        _clipped(max(sigma_distance, _tail(error[single & tell, :2]))),
        _clipped(max(sigma_turn, _tail(error[single, 2]))),
        float(np.median(driven)) if len(driven) else _INITIAL_STEP,
    )


def _clipped(sigma: float) -> float:
    """The standard deviation clamped to its bounds."""
    return min(max(sigma, _SIGMAS[0]), _SIGMAS[1])


def _believed(share: float) -> float:
    """The relative error of distances or turns, or zero if it is too large to come from the wheels."""
    return share if _GAINS[0] < 1.0 + share < _GAINS[1] else 0.0


def _fit_turns(steps: Pose, spans: MatchedSpans) -> tuple[list[float], float]:
    """Turn per metre, relative error of turns and bias of a match; and the standard deviation of a step."""
    summed = np.cumsum(np.column_stack([forward(steps), steps[:, 2]]), axis=0)
    sums = np.concatenate([np.zeros((1, 2)), summed])
    driven, turned = (sums[spans.end] - sums[spans.first]).T
    telling = turned**3 / (turned**2 + _TELLING_TURN**2)
    design = np.column_stack([driven, telling, np.ones_like(driven)])
    missed = wrap_angle(spans.motions[:, 2] - turned)
    spread = np.array([_TURN_PER_METRE_SIGMA, _SCALE_SIGMA, _BIAS_TURN_SIGMA])
    told = spans.variances_along(np.array([[0.0, 0.0, 1.0]]))
    return _fit(design, missed, told, spans.lengths, spread)


def _fit_path(
    reach: NDArray[np.float64],
    along: NDArray[np.float64],
    forward: NDArray[np.float64],
    told: NDArray[np.float64],
    lengths: NDArray[np.int64],
) -> tuple[list[float], float]:
    """Relative error of distances and bias of a match along the direction of travel; and the standard
    deviation of a step."""
    if len(reach) < _MIN_SPANS:
        return [0.0, 0.0], _INITIAL_SIGMA
    design = np.column_stack([reach, np.sign(forward)])
    spread = np.array([_SCALE_SIGMA, _BIAS_DISTANCE_SIGMA])
    return _fit(design, along - reach, told, lengths, spread)


def _fit(
    design: NDArray[np.float64],
    missed: NDArray[np.float64],
    told: NDArray[np.float64],
    lengths: NDArray[np.int64],
    spread: NDArray[np.float64],
) -> tuple[list[float], float]:
    """Least squares with Cauchy weights and a zero-mean prior on the faults; also the standard deviation per
    step. The variance of a residual is the sum of the match's own variance ``told`` (M,), one common to all
    matches, and one per step times the span's length. Each step is part of many spans, so their weights are
    divided by that number to count its errors once."""
    found = np.full(len(spread) + 1, np.inf)
    of_spans = np.unique(lengths)
    groups = [np.flatnonzero(lengths == length) for length in of_spans]
    weight, shared = np.ones(len(missed)), _INITIAL_SIGMA**2 * lengths
    for _ in range(_ITERATIONS):
        scaled = weight / (told + shared * _SPANS_PER_STEP + _SMALLEST**2)
        normal = design.T @ (scaled[:, None] * design) + np.diag(spread**-2.0)
        solution = np.linalg.solve(normal, design.T @ (scaled * missed))
        residual, variance = missed - design @ solution, told + shared + _SMALLEST**2
        weight = 1.0 / (1.0 + residual**2 / (variance * _LOSS_WIDTH**2))
        of_match, per_step = _variances(residual, told, of_spans, groups, variance**-2.0)
        shared = of_match + per_step * lengths
        before, found = found, np.append(solution / spread, np.sqrt(per_step) / _INITIAL_SIGMA)
        if np.abs(found - before).max() < _SETTLED:
            break
    return solution.tolist(), float(np.sqrt(per_step))


def _variances(
    residual: NDArray[np.float64],
    told: NDArray[np.float64],
    of_spans: NDArray[np.int64],
    spans: Sequence[NDArray[np.int64]],
    weight: NDArray[np.float64],
) -> tuple[float, float]:
    """Variances common to all matches and per step that explain the spread of the residuals (M,) at each
    length (L,) beyond the matches' own variances ``told``; ``spans`` are L groups of indices. Where they show
    too little, the step keeps its initial variance."""
    spread = np.array([SIGMA_PER_MEDIAN**2 * _median(residual[at] ** 2, weight[at]) for at in spans])
    known = np.array([np.average(told[at], weights=weight[at]) for at in spans])
    counts = np.array([weight[at].sum() ** 2 / (weight[at] ** 2).sum() for at in spans])
    initial = _INITIAL_SIGMA**2
    design = np.vstack([np.column_stack([np.ones(len(spans)), of_spans]), [0.0, 1.0]])
    by = np.append(
        np.sqrt(counts) / (np.maximum(spread, known) + _SMALLEST**2), np.sqrt(_MIN_SPANS) / initial
    )
    (of_match, per_step), _ = nnls(design * by[:, None], np.append(spread - known, initial) * by)
    return float(of_match), float(per_step)


def _median(values: NDArray[np.float64], weights: NDArray[np.float64]) -> float:
    """Weighted median of values (M,)."""
    order = np.argsort(values)
    until = np.cumsum(weights[order])
    return float(values[order[np.searchsorted(until, 0.5 * until[-1])]])


def _tail(error: NDArray[np.float64]) -> float:
    """The quantile that most errors (M,) or (M, 2) stay below."""
    return float(np.quantile(np.abs(error), _TAIL_SHARE)) if len(error) else _INITIAL_SIGMA
