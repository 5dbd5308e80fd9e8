"""The particle filter: predict, weight, find the dominant cluster, resample."""

from math import isfinite

import numpy as np
from numpy.typing import NDArray

from racecar.localization.filter.particle_kernels import in_heaviest_block, moments_about, move_particles
from racecar.localization.odometry.motion_model import MotionStep, path_and_turn
from racecar.localization.odometry.slip import CHANGE_AFTER, changed_slips
from racecar.maps.geometry.se2 import Pose, mean_angle

_SQUARE = 0.5
"""Cell size in metres of the histogram that finds the densest place, half of `_RADIUS`, so that a block of
two by two is within the cluster around its centre."""
_SECTORS = 8
"""Heading bins: eighths of a turn, so that a block of two is a quarter of a turn, which separates headings
from those along a crossing corridor."""
_RADIUS, _HALF_ANGLE = 1.0, 1.0
"""Metres and radians around that place within which particles belong to the cluster. Chosen by judgement,
since no tracked cloud is wider."""
_WHOLE = 1.0 - 1e-9
"""Total weight of all particles: below 1 because of rounding."""
_FULL_SLIP = np.ones(2)
"""Slip scales of uncalibrated odometry: the full slip of the settings, by definition."""
_INDEPENDENT_AFTER = 0.1
"""Metres plus radians since the last scan after which a scan has full weight, since map errors affect nearby
scans alike: two cells of a usual map. Measured: where all count in full, a quarter of the errors of slow
recordings lie outside the 95 % ellipse; with 0.2 more of cars whose wheels report half get lost."""
_MOST_EVIDENCE = 6.0
"""Largest log-likelihood of a scan against a particle, because no single scan may rule one out. Measured:
without that, after a second without odometry a car is misplaced for three seconds in one of six drives."""
_INJECTION_INTERVAL = 20
"""One in this many particles is injected for odometry that is entirely wrong. Measured: without that fr079,
whose odometry counts reversing as driving forward, was lost for minutes."""
_RESAMPLE_BELOW = 0.5
"""Share of effective particles below which the filter is resampled: half, as usual, since resampling loses
diversity."""


class ParticleFilter:
    """Weighted samples of the pose."""

    def __init__(self, map_from_base: Pose, rng: np.random.Generator) -> None:
        self.map_from_base = map_from_base
        """(N, 3)"""
        self.weights = _even_weights(len(map_from_base))
        """(N,) weights with sum 1."""
        self._slips = np.zeros((len(map_from_base), 3))
        self._slip_age = np.inf
        self._effort = np.zeros(2)
        self._rng = rng

    def __len__(self) -> int:
        return len(self.map_from_base)

    @property
    def effective_size(self) -> float:
        """Effective sample size."""
        return float(1.0 / (self.weights @ self.weights))

    @property
    def lag(self) -> float:
        """Estimated lag of the odometry, see `slip`."""
        return float(self.weights @ self._slips[:, 2])

    def predict(self, step: MotionStep, slip: float, slip_scale: NDArray[np.float64] = _FULL_SLIP) -> None:
        """Motion update: move each particle by the step with its own odometry error.

        Slip persists for a while, so that the filter learns it. Where wheels can slip at all, a few particles
        are injected with errors as large as the step. ``slip_scale`` (2,), 0 to 1, scales ``slip`` for the
        distances and turns of this car's odometry.
        """
        if step.travel == 0.0:
            return
        self._slip_age += step.seconds
        self._effort = np.maximum(self._effort, step.effort)
        if self._slip_age >= CHANGE_AFTER:
            most = slip * slip_scale
            self._slips = changed_slips(self._slips, self._slip_age, self._effort, most, self._rng)
            self._slip_age, self._effort = 0.0, np.zeros(2)
        self.map_from_base = move_particles(
            self.map_from_base,
            self._slips,
            step.base_from_next_base,
            step.behind,
            step.deviations,
            self._rng.standard_normal((len(self), 3), dtype=np.float32),
        )
        if slip > 0.0 and isfinite(step.travel):
            distance, turn = slip_scale * path_and_turn(step.base_from_next_base)
            self.inject(np.array([distance, distance, turn]))

    def inject(self, deviations: Pose) -> None:
        """Let a few particles ignore the odometry, with deviations (3,) in metres and radians.

        Wheels spin, cars bump and are pushed.
        """
        self._disturb(self._few(), deviations)

    def propose(self, map_from_base: Pose, covariance: NDArray[np.float64]) -> None:
        """Move a few particles to another estimate (3,) of the pose, with its covariance (3, 3).

        The next scan weights them against the rest.
        """
        few = self._few()
        self.map_from_base[few] = map_from_base
        self._disturb(few, np.sqrt(np.diag(covariance)))

    def spread(self, deviations: Pose) -> None:
        """Perturb all particles by deviations (3,) in metres and radians, so that copies differ."""
        self._disturb(slice(None), deviations)

    def weigh(self, log_likelihood: NDArray[np.float64], travel: float | None = None) -> None:
        """Measurement update with the log-likelihood (N,) of a scan, ``travel`` metres plus radians later.

        Its weight grows with the travel and is bounded; a first scan, without travel, has full weight.
        """
        gain = log_likelihood - log_likelihood.max()
        if travel is not None:
            gain = np.maximum(min(travel / _INDEPENDENT_AFTER, 1.0) * gain, -_MOST_EVIDENCE)
        weights = self.weights * np.exp(gain)
        self.weights = weights / weights.sum()

    def moments(self) -> tuple[Pose, NDArray[np.float64], float]:
        """Mean (3,), covariance (3, 3) and weight of the dominant cluster."""
        return cluster_moments(self.map_from_base, self.weights)

    def resample(self, count: int) -> None:
        """Resample to ``count`` particles if too few are effective or there are more."""
        if self.effective_size >= _RESAMPLE_BELOW * len(self) and len(self) <= count:
            return
        chosen = systematic_resample(self.weights, count, self._rng)
        self.map_from_base = self.map_from_base.take(chosen, axis=0)
        self._slips = self._slips.take(chosen, axis=0)
        self.weights = _even_weights(count)

    def _few(self) -> slice:
        """A random subset, so that all particles take turns."""
        return slice(self._rng.integers(_INJECTION_INTERVAL), None, _INJECTION_INTERVAL)

    def _disturb(self, which: slice, deviations: Pose) -> None:
        chosen = self.map_from_base[which]
        chosen += deviations * self._rng.standard_normal(chosen.shape)


def systematic_resample(
    weights: NDArray[np.float64], count: int, rng: np.random.Generator
) -> NDArray[np.int64]:
    """Indices (count,) into weights (N,) with sum 1, ascending.

    A single random number (low variance): a particle of weight w is taken floor or ceil of w·count times.
    """
    taken = np.minimum(np.ceil(np.cumsum(weights) * count - rng.random()), count).astype(np.int64)
    taken[-1] = count  # rounding of the sum
    return np.repeat(np.arange(len(weights)), taken - np.append(0, taken[:-1]))


def _even_weights(count: int) -> NDArray[np.float64]:
    return np.full(count, 1.0 / count)


def cluster_moments(
    map_from_base: Pose, weights: NDArray[np.float64]
) -> tuple[Pose, NDArray[np.float64], float]:
    """Mean (3,), covariance (3, 3) and weight of the dominant cluster of particles (N, 3).

    The search is skipped if all particles are close to the first one.
    """
    mean, covariance, weight = moments_about(map_from_base[0], map_from_base, weights, _RADIUS, _HALF_ANGLE)
    if weight < _WHOLE:
        center = _heaviest_place(map_from_base, weights)
        mean, covariance, weight = moments_about(center, map_from_base, weights, _RADIUS, _HALF_ANGLE)
    return mean, covariance, min(weight, 1.0)


def _heaviest_place(map_from_base: Pose, weights: NDArray[np.float64]) -> Pose:
    """Mean (3,) of the particles in the heaviest block of two by two cells and two heading bins.

    Each particle is in eight blocks, so that bin boundaries do not matter.
    """
    squares = ((map_from_base[:, :2] - map_from_base[:, :2].min(axis=0)) // _SQUARE).astype(np.int64)
    sectors = (map_from_base[:, 2] // (2.0 * np.pi / _SECTORS)).astype(np.int64) % _SECTORS
    is_there = in_heaviest_block(squares, sectors, _SECTORS, weights)
    there, weights = map_from_base[is_there], weights[is_there]
    x, y = np.average(there[:, :2], axis=0, weights=weights)
    return np.array([x, y, mean_angle(there[:, 2], weights)])
