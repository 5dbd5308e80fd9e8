"""Find misled scan matches, for example on a slope where the ground comes into view and moves along.

If wheels and matches contradict each other, either may be wrong. Where wheels slip, matches are still
consistent: one over several steps equals the chain of those over fewer, up to their covariance. Where scans
are misled, such cycles do not close. So a contradicted stretch of steps is blamed on the scans if few of its
cycles close, the sooner the worse scans fit there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from racecar.mapping.graph.constraint import Constraint
from racecar.maps.geometry.se2 import Pose, adjoint, between, chained, compose, inverse
from racecar.sensors.motion.calibration import SIGMA_PER_MEDIAN, MatchedSpans

_MOST_SIGMAS = 3.0
"""Standard deviations by which matches may differ from wheels. Chosen by judgement: usual for outliers."""
_LEAST_SIGMA = 0.0005
"""Lower bound of the standard deviation in metres and radians, since a good match errs by it. Measured in
simulation: 0.0005 to 0.001 rad, 0.005 m."""
_MIN_MATCHES = 20
"""Matches needed to estimate their spread. Chosen by judgement: the median of fewer says little."""
_MIN_CONTRADICTED = 0.33
"""Share of the matches over a step that the wheels must contradict. Chosen by judgement: ground in view
sometimes misleads short matches, sometimes long ones."""
_MOST_SIGMAS_OPEN = 1.5
"""Standard deviations, from the matches' covariances, up to which a cycle is closed. Measured: nine of ten
are where scans are not misled, since matches of the same scans err alike."""
_TIMES_USUAL = 2.5
"""Multiple of the median of cycles over as many steps up to which one is closed, because some covariances are
too small. Measured: on fr079 the median is 1.8 standard deviations over 30 steps."""
_PRESUMED_CLOSED = 20.0
"""Pseudo-count of closed cycles over a stretch, so that a few open ones prove nothing."""
_MIN_CLOSED = 0.6
"""Share of closed cycles over a stretch without misled scans, at usual fit. Measured: 0.7 and more where
wheels slip or know no turns, on hilly campuses mostly 0.3 to 0.6."""
_USUAL_FIT = 1.1
"""Factor by which scans may fit worse over a stretch than elsewhere without consequence. Measured: 1.0 to 1.1
on a track and in an office, 1.2 to 1.7 on hilly campuses. Chosen by judgement: beyond it, the fourth power of
the excess weighs as much as open cycles do."""


@dataclass(frozen=True, eq=False)
class MatchesAlongPath:
    """M matches between keyframes close along the path, and the wheels' steps."""

    spans: MatchedSpans
    """From the step after the earlier keyframe to the later keyframe, as motions of the laser."""
    residuals: NDArray[np.float64]
    """(M,) residuals of the scan matches in metres."""
    steps: Pose
    """(K - 1, 3) wheel steps; NaN where there are none."""

    @classmethod
    def of(
        cls,
        matches: Sequence[Constraint],
        residuals: NDArray[np.float64],
        by_wheels: Sequence[Constraint],
        keyframes: int,
    ) -> "MatchesAlongPath":
        """Build from constraints of both kinds, their number of keyframes, and residuals (M,) of matches."""
        steps = np.full((keyframes - 1, 3), np.nan)
        for constraint in by_wheels:
            steps[constraint.from_keyframe] = constraint.from_pose_to_pose
        ends = np.array([(c.from_keyframe, c.to_keyframe) for c in matches], dtype=np.int64).reshape(-1, 2)
        motions = np.array([c.from_pose_to_pose for c in matches]).reshape(-1, 3)
        information = np.array([c.information for c in matches]).reshape(-1, 3, 3)
        return cls(MatchedSpans(ends[:, 0], ends[:, 1], motions, information), residuals, steps)

    def misled_steps(self) -> NDArray[np.bool_]:
        """(K - 1,) whether scan matching is misled in a step."""
        are_contradicted = self.are_contradicted(np.ones(len(self.spans.first), dtype=np.bool_))
        is_doubted = self._per_step(are_contradicted) > _MIN_CONTRADICTED * self._per_step()
        closed, cycles = self._cycles()
        worse = self._worse_fit()
        misled = np.zeros(len(self.steps), dtype=np.bool_)
        edges = np.flatnonzero(np.diff(np.concatenate([[False], is_doubted, [False]])))
        for begin, end in edges.reshape(-1, 2):
            share = (closed[begin:end].sum() + _PRESUMED_CLOSED) / (
                cycles[begin:end].sum() + _PRESUMED_CLOSED
            )
            bad_fit = max(np.median(worse[begin:end]) / _USUAL_FIT, 1.0)
            misled[begin:end] = share < _MIN_CLOSED * bad_fit**4
        return misled

    def _worse_fit(self) -> NDArray[np.float64]:
        """(K - 1,) factor by which scans fit worse over a step than over others with such a turn, since they
        fit worse in turns anyway; 1 without a match."""
        of_steps = np.flatnonzero(self.spans.lengths == 1)
        by_turn = of_steps[np.argsort(np.abs(self.spans.motions[of_steps, 2]))]
        worse = np.ones(len(self.steps))
        if len(by_turn):
            residuals = self.residuals[by_turn]
            usual = median_filter(residuals, size=len(residuals) // 5 + 1, mode="nearest")
            worse[self.spans.first[by_turn]] = residuals / usual
        return worse

    def are_contradicted(self, usual: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(M,) whether the wheels contradict a match by more than the ``usual`` ones (M,)."""
        chain = chained(np.nan_to_num(self.steps))
        off = between(self.spans.motions, between(chain[self.spans.first], chain[self.spans.end]))
        off[self.spans.are_over(np.isnan(self.steps[:, 0]))] = np.nan
        contradicted = np.zeros(len(off), dtype=np.bool_)
        for lag in np.unique(self.spans.lengths):
            those = self.spans.lengths == lag
            contradicted[those] = _are_outliers(off[those], off[those & usual])
        return contradicted

    def _per_step(self, which: NDArray[np.bool_] | bool = True) -> NDArray[np.float64]:
        """(K - 1,) number of selected matches (M,) over each step; long ones do not count more in total."""
        of_step = np.zeros(len(self.steps))
        for lag in np.unique(self.spans.lengths):
            begin = np.zeros(len(self.steps) + 1 - lag)
            begin[self.spans.first[which & (self.spans.lengths == lag)]] = 1.0
            of_step += np.convolve(begin, np.full(lag, 1.0 / lag))
        return of_step

    def _cycles(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(K - 1,) number of closed cycles and of all cycles over each step, counted likewise."""
        closed, cycles = np.zeros((2, len(self.steps)))
        of_lag = {lag: self._over(lag) for lag in [1, *np.unique(self.spans.lengths).tolist()]}
        for lag in [lag for lag in of_lag if lag > 1]:
            sigmas = _Motions.chained(_legs(lag, of_lag)).sigmas_off(of_lag[lag])
            exist = ~np.isnan(sigmas)
            usual = np.median(sigmas[exist]) if np.count_nonzero(exist) >= _MIN_MATCHES else 0.0
            are_closed = sigmas < max(_MOST_SIGMAS_OPEN, _TIMES_USUAL * usual)
            closed += np.convolve(are_closed, np.full(lag, 1.0 / lag))
            cycles += np.convolve(exist, np.full(lag, 1.0 / lag))
        return closed, cycles

    def _over(self, lag: int) -> "_Motions":
        """Matches over ``lag`` steps, by their first keyframe."""
        those, keyframes = self.spans.lengths == lag, len(self.steps) + 1
        motions = _Motions(np.full((keyframes - lag, 3), np.nan), np.zeros((keyframes - lag, 3, 3)))
        motions.poses[self.spans.first[those]] = self.spans.motions[those]
        motions.covariances[self.spans.first[those]] = np.linalg.inv(self.spans.information[those])
        return motions


class _Motions(NamedTuple):
    """N motions over the same number of steps, NaN where not measured."""

    poses: Pose
    """(N, 3)"""
    covariances: NDArray[np.float64]
    """(N, 3, 3) in the tangent frame of the end poses."""

    @classmethod
    def chained(cls, legs: "Sequence[_Motions]") -> "_Motions":
        """Chain consecutive motions; errors are assumed independent."""
        poses, covariances = legs[0]
        for leg in legs[1:]:
            moved = adjoint(inverse(leg.poses))
            covariances = moved @ covariances @ moved.transpose(0, 2, 1) + leg.covariances
            poses = compose(poses, leg.poses)
        return cls(poses, covariances)

    def sigmas_off(self, others: "_Motions") -> NDArray[np.float64]:
        """(N,) Mahalanobis distances between equal motions; NaN where either was not measured."""
        off = between(self.poses, others.poses)
        known = np.flatnonzero(~np.isnan(off[:, 0]))
        information = np.linalg.inv(self.covariances[known] + others.covariances[known])
        sigmas = np.full(len(off), np.nan)
        sigmas[known] = np.sqrt(np.einsum("ni,nij,nj->n", off[known], information, off[known]))
        return sigmas


def _legs(lag: int, of_lag: Mapping[int, _Motions]) -> list[_Motions]:
    """The longest matches that chain to ``lag`` steps, each by the start of the chain."""
    legs, at, places = [], 0, len(of_lag[lag].poses)
    while at < lag:
        leg = max(shorter for shorter in of_lag if shorter < lag and shorter <= lag - at)
        legs.append(_Motions(*(values[at : at + places] for values in of_lag[leg])))
        at += leg
    return legs


def poses_by_wheels(poses: Pose, along: MatchesAlongPath, where: NDArray[np.bool_]) -> Pose:
    """The poses (K, 3) if the wheels are trusted in some steps (K - 1,)."""
    steps = between(poses[:-1], poses[1:])
    believed = where & ~np.isnan(along.steps[:, 0])
    steps[believed] = along.steps[believed]
    return compose(poses[0], chained(steps))


def _are_outliers(errors: Pose, usual: Pose) -> NDArray[np.bool_]:
    """(N,) whether errors (N, 3) are outliers among usual ones (U, 3); NaN are not."""
    usual = usual[~np.isnan(usual[:, 0])]
    if len(usual) < _MIN_MATCHES:
        return np.zeros(len(errors), dtype=np.bool_)
    sigma = np.maximum(SIGMA_PER_MEDIAN * np.median(np.abs(usual), axis=0), _LEAST_SIGMA)
    return np.asarray((np.abs(errors) > _MOST_SIGMAS * sigma).any(axis=1))
