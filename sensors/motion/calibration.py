"""Wheel odometry calibrated from the log itself: its systematic errors, and how far it can be trusted.

All three of its `OdometryFaults` show against the motion that scan matching measured over spans of
some steps. What grows with the length of a span is the wheels' fault; scans err too, by ground that moves
along with a tilted laser for instance, but not more over a long span than over a short one.
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
"""Of reweighted least squares, at most. Measured: with 8 a simulated campus was off by 0.15 m instead of
0.07 m."""
_SETTLED = 1e-5
"""Share of its usual size by which an iteration changes what is found, below which the fit is settled. By
judgement: far less than a fault is known to."""
SIGMA_PER_MEDIAN = 1.4826
"""Standard deviation of a Gaussian over the median of its absolute deviations, by definition of its
quantiles."""
_TELLING_TURN = 0.15
"""Radians of a span from which its turn rather than its noise shows by what factor turns are off, since on
straights the wheels' turns are but noise: regressing on it (errors in variables) makes the factor of honest
wheels 0.2 to 0.7 on open ground, where matches then follow the wheels so corrected. Measured: with 0.1 wheels
that err by 3 mrad a step at random still seem to turn by 17 % too far, with 0.15 by 9 %."""
_GAINS = 0.4, 2.5
"""Between which factors of distances and turns lie, by judgement: a radius that is told as the diameter, and
some room. What matches show beyond is not the wheels' fault."""
_SMALLEST = 1e-6
"""Metres or radians, so that nothing is divided by zero where the car stood or the fit is perfect."""
_MIN_SPANS = 40
"""Spans below which nothing is fitted. By judgement: those of some ten steps."""
_MIN_REACH = 0.1
"""Metres of a span from which it shows the path's scale. By judgement: some times what a match errs by."""
_SPANS_PER_STEP = 8.0
"""Spans in which each step takes part as one of its own, so that they count once: the number of keyframes
that each is tied to."""
_INITIAL_SIGMA = 0.05
"""Standard deviation of a step, metres and radians, before anything is fitted. By judgement: wheels that
nobody has looked after."""
_INITIAL_STEP = 0.3
"""Metres of a usual step, before anything is fitted, since keyframes are so far apart."""
_TURN_PER_METRE_SIGMA = 0.02
"""Radians that wheels usually miss per metre. Measured: on aces, fr079 and intel up to 0.06."""
_SCALE_SIGMA = 0.1
"""Share by which turns and distances are usually wrong. Measured on recordings: 2 to 5 %; twice as much, for
a wheel of another size is no rarity. With 0.05, wheels that missed 13 % on simulated open ground were
corrected by less."""
_BIAS_TURN_SIGMA = 0.003
"""Radians by which matches are usually biased. Measured with ground returns outdoors: 0.0007."""
_BIAS_DISTANCE_SIGMA = 0.01
"""Metres likewise. By judgement: as much as a laser errs by."""
_SIGMAS = 0.01, 0.3
"""Least and largest standard deviation of a step, metres and radians. By judgement: no better than a scan
match, and a whole keyframe step."""
_TAIL_SHARE = 0.8
"""Share of the steps that err less than the tail: what a step is worth before scans were matched, since it
may be one of the bad ones."""
_LOSS_WIDTH = 2.0
"""Width of the Cauchy loss of the fit, in spreads of the residuals. The 95 % efficiency on Gaussian errors is
at 2.385 (Holland and Welsch, 1977); by judgement a little less."""


@dataclass(frozen=True)
class WheelCalibration:
    """Corrections and standard deviations per keyframe step; of wheels as they are, while nothing is known
    about them."""

    faults: OdometryFaults = field(default_factory=OdometryFaults)
    sigma_distance: float = _INITIAL_SIGMA
    """Metres."""
    sigma_turn: float = _INITIAL_SIGMA
    """Radians."""
    tail_distance: float = _INITIAL_SIGMA
    """Metres that most steps err less than."""
    tail_turn: float = _INITIAL_SIGMA
    """Radians, likewise."""
    usual_step: float = _INITIAL_STEP
    """Metres of the steps that all this is true of; longer ones err by more."""

    def prior(self, step: Pose) -> NDArray[np.float64]:
        """(3, 3) information of a corrected ``step`` (3,) before scans were matched: it may be one of the bad
        ones."""
        return self._information(step, self.tail_distance, self.tail_turn)

    def information(self, step: Pose) -> NDArray[np.float64]:
        """(3, 3) of a corrected ``step`` (3,)."""
        return self._information(step, self.sigma_distance, self.sigma_turn)

    def _information(self, step: Pose, distance: float, turn: float) -> NDArray[np.float64]:
        """By the standard deviations of a usual step; the errors of a longer one add up (random walk)."""
        usual_steps = max(1.0, float(np.hypot(step[0], step[1])) / self.usual_step)
        return np.diag([distance**-2.0, distance**-2.0, turn**-2.0]) / usual_steps


@dataclass(frozen=True, eq=False)
class MatchedSpans:
    """The motion over some steps in a row, as scans were matched over them: M spans."""

    first: NDArray[np.int64]
    """(M,) the step in which each begins."""
    end: NDArray[np.int64]
    """(M,) the step after its last."""
    motions: Pose
    """(M, 3)"""
    information: NDArray[np.float64]
    """(M, 3, 3)"""

    @property
    def lengths(self) -> NDArray[np.int64]:
        """(M,) in steps."""
        return self.end - self.first

    def are_over(self, steps: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(M,) which span any of some steps (N,)."""
        until = np.concatenate([[0], np.cumsum(steps)])
        return np.asarray(until[self.end] > until[self.first])

    def chosen(self, which: NDArray[np.bool_]) -> "MatchedSpans":
        """Some of them (M,)."""
        return MatchedSpans(self.first[which], self.end[which], self.motions[which], self.information[which])

    def variances_along(self, towards: NDArray[np.float64]) -> NDArray[np.float64]:
        """(M,) of the motions in directions (M, 3): along a bare corridor a match says nothing but what it
        began with."""
        variances: NDArray[np.float64] = np.einsum("mi,mij,mj->m", towards, self._covariance, towards)
        return variances

    @cached_property
    def _covariance(self) -> NDArray[np.float64]:
        """(M, 3, 3)"""
        return np.asarray(np.linalg.inv(self.information), dtype=np.float64)


def calibrate(
    steps: Pose, spans: MatchedSpans, fused: Callable[[Pose], Pose] = lambda corrected: corrected
) -> WheelCalibration:
    """Robust fit of odometry steps (N, 3), NaN where there are none, to the motion over spans of them.

    What is left of errors is that of the corrected steps after a gyroscope was ``fused`` with them.
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
    """A standard deviation within the limits."""
    return min(max(sigma, _SIGMAS[0]), _SIGMAS[1])


def _believed(share: float) -> float:
    """By what share distances or turns are off; nothing where no wheels are."""
    return share if _GAINS[0] < 1.0 + share < _GAINS[1] else 0.0


def _fit_turns(steps: Pose, spans: MatchedSpans) -> tuple[list[float], float]:
    """Turn per metre, by what share turns are off, and the bias of a match; and the deviation of a step."""
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
    """By what share paths are off, and the bias of a match in the direction of travel; and the deviation of a
    step."""
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
    """Least squares with Cauchy weights and a prior, of faults that are usually none; and the standard
    deviation per step. The variance of a residual is what the match tells of itself, (M,), what all matches
    err by, and what a step does, as often as a span is long. Since each step takes part in many spans, its
    errors are told as often, and count once."""
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
    """Of any match and of a step, such that they explain the spread of the residuals (M,) at each length (L,)
    beyond what matches tell, by L groups of them; a step has that with which it began where they tell too
    little."""
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
    """Of values (M,) that count as much as their weights (M,)."""
    order = np.argsort(values)
    until = np.cumsum(weights[order])
    return float(values[order[np.searchsorted(until, 0.5 * until[-1])]])


def _tail(error: NDArray[np.float64]) -> float:
    """What most errors (M,) or (M, 2) stay below."""
    return float(np.quantile(np.abs(error), _TAIL_SHARE)) if len(error) else _INITIAL_SIGMA
