"""The particle filter: predict, weigh, find the dominant cluster, resample."""

from math import isfinite

import numpy as np
from numpy.typing import NDArray

from racecar.localization.filter.clusters import cluster_moments
from racecar.localization.filter.particle_kernels import move_particles
from racecar.localization.odometry.motion_model import MotionStep, path_and_turn
from racecar.localization.odometry.slip import CHANGE_AFTER, changed_slips
from racecar.maps.geometry.se2 import Pose

_FULL_SLIP = np.ones(2)
"""Slip scales of a car of whose odometry nothing is known: all of the settings' slip, by definition."""
_INDEPENDENT_AFTER = 0.1
"""Metres plus radians since the last scan after which one counts in full, since what the map has wrong
disturbs scans taken near each other alike: two cells of a usual map. Measured: where all count in full, a
quarter of the errors of slow recordings lie outside the 95 % ellipse; with 0.2 more of cars whose wheels tell
half get lost."""
_MOST_EVIDENCE = 6.0
"""Log-likelihood by which one scan counts against a particle at most, because no single scan may rule one
out. Measured: without that, after a second without odometry a car is elsewhere for three in one of six
drives."""
_INJECTION_INTERVAL = 20
"""One particle in so many is injected where all of the odometry is wrong. Measured: without that fr079, whose
odometry counts reversing as driving forward, was lost for minutes."""
_RESAMPLE_BELOW = 0.5
"""Share of effective particles below which all are drawn anew: half, as usual, since drawing anew loses
variety."""


class ParticleFilter:
    """Weighted guesses of the pose."""

    def __init__(self, map_from_base: Pose, rng: np.random.Generator) -> None:
        self.map_from_base = map_from_base
        """(N, 3)"""
        self.weights = _even_weights(len(map_from_base))
        """(N,) that sum to 1."""
        self._slips = np.zeros((len(map_from_base), 3))
        self._slip_age = np.inf
        self._effort = np.zeros(2)
        self._rng = rng

    def __len__(self) -> int:
        return len(self.map_from_base)

    @property
    def effective_size(self) -> float:
        """How many equally weighted particles these are worth."""
        return float(1.0 / (self.weights @ self.weights))

    @property
    def lag(self) -> float:
        """By how much the car is thought to be behind what its odometry says, see `slip`."""
        return float(self.weights @ self._slips[:, 2])

    def predict(self, step: MotionStep, slip: float, slip_scale: NDArray[np.float64] = _FULL_SLIP) -> None:
        """Move all particles by a step, each by its own guess of how that was measured wrongly.

        The guesses of the slip last for a while, so that the filter learns it. Where wheels can slip at all,
        a few particles are injected as far off as the step is long. ``slip_scale`` (2,), 0 to 1, is the share
        of ``slip`` that the distances and turns of this car's odometry deserve.
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
        """Let a few particles take the odometry for all wrong, by deviations (3,) in metres and radians.

        Wheels spin, cars bump and are pushed.
        """
        self._disturb(self._few(), deviations)

    def propose(self, map_from_base: Pose, covariance: NDArray[np.float64]) -> None:
        """Let a few particles stand about another opinion (3,) of the place, with its covariance (3, 3).

        The next scan weighs them against the rest.
        """
        few = self._few()
        self.map_from_base[few] = map_from_base
        self._disturb(few, np.sqrt(np.diag(covariance)))

    def spread(self, deviations: Pose) -> None:
        """Disturb all particles by deviations (3,) in metres and radians, so that copies of one differ."""
        self._disturb(slice(None), deviations)

    def weigh(self, log_likelihood: NDArray[np.float64], travel: float | None = None) -> None:
        """Take in how well each particle (N,) explains a scan so many metres plus radians after the last.

        It counts by how far that is, and by a bound; a first scan, which has no last, counts in full.
        """
        gain = log_likelihood - log_likelihood.max()
        if travel is not None:
            gain = np.maximum(min(travel / _INDEPENDENT_AFTER, 1.0) * gain, -_MOST_EVIDENCE)
        weights = self.weights * np.exp(gain)
        self.weights = weights / weights.sum()

    def moments(self) -> tuple[Pose, NDArray[np.float64], float]:
        """Mean (3,), covariance (3, 3) and weight of the heaviest cluster."""
        return cluster_moments(self.map_from_base, self.weights)

    def resample(self, count: int) -> None:
        """Draw so many particles anew when too few are effective, or there are more."""
        if self.effective_size >= _RESAMPLE_BELOW * len(self) and len(self) <= count:
            return
        chosen = systematic_resample(self.weights, count, self._rng)
        self.map_from_base = self.map_from_base.take(chosen, axis=0)
        self._slips = self._slips.take(chosen, axis=0)
        self.weights = _even_weights(count)

    def _few(self) -> slice:
        """Drawn anew, so that each particle has its turn."""
        return slice(self._rng.integers(_INJECTION_INTERVAL), None, _INJECTION_INTERVAL)

    def _disturb(self, which: slice, deviations: Pose) -> None:
        chosen = self.map_from_base[which]
        chosen += deviations * self._rng.standard_normal(chosen.shape)


def systematic_resample(
    weights: NDArray[np.float64], count: int, rng: np.random.Generator
) -> NDArray[np.int64]:
    """Indices (count,) into weights (N,) that sum to 1, ascending.

    One random number for all (low variance): a particle of weight w is taken floor or ceil of w·count times.
    """
    taken = np.minimum(np.ceil(np.cumsum(weights) * count - rng.random()), count).astype(np.int64)
    taken[-1] = count  # the sum is rounded
    return np.repeat(np.arange(len(weights)), taken - np.append(0, taken[:-1]))


def _even_weights(count: int) -> NDArray[np.float64]:
    return np.full(count, 1.0 / count)
