"""The particle filter: predict, weigh, find the dominant cluster, resample."""

from math import hypot, inf, isfinite

import numpy as np
from numpy.typing import NDArray

from racecar.localization.filter.cluster_kernels import cluster_moments
from racecar.localization.filter.resampling_kernels import systematic_resample, take_rows
from racecar.localization.filter.weights_kernels import take_evidence
from racecar.localization.numerics.noise_kernels import random_seed
from racecar.localization.odometry.motion_model_kernels import disturb_particles, move_particles
from racecar.localization.odometry.motion_step import MotionStep
from racecar.localization.odometry.slip_kernels import CHANGE_AFTER, changed_slips
from racecar.maps.geometry.se2 import Pose

_FULL_SLIP = np.ones(2)
"""Slip scales of a car of whose odometry nothing is known: all of the settings' slip, by definition."""
_EVIDENCE_PER_TRAVEL = 40.0
"""Log-likelihood by which one scan counts against a particle at most, per metre plus radian since the last
scan: what the map has wrong disturbs scans taken near each other alike. Measured: without a bound a tenth
fewer errors lie inside the 95 % ellipse on maps of recordings."""
_LEAST_EVIDENCE, _MOST_EVIDENCE = 2.0, 6.0
"""Log-likelihood between which that bound stays, however short or long the travel, because no single scan may
rule a particle out."""
_INJECTION_INTERVAL = 20
"""One particle in so many is injected where all of the odometry is wrong. Measured: without that fr079, whose
odometry counts reversing as driving forward, was lost for minutes."""
_RESAMPLE_BELOW = 0.5
"""Share of effective particles below which all are drawn anew: half, as usual, since drawing anew loses
variety."""
CLUSTER_SIZES = (0.5, 1.0, 1.0)
"""Metres: side of the squares that are compared for the heaviest place; metres and radians about it within
which particles belong to its cluster, by judgement, since no tracked cloud reaches farther."""


class ParticleFilter:
    """Weighted guesses of the pose; weights are kept as logarithms, so that no scan makes them vanish."""

    def __init__(self, map_from_base: Pose, rng: np.random.Generator) -> None:
        self.map_from_base = map_from_base
        """(N, 3)"""
        self.weights: NDArray[np.float64] = np.empty(0)
        """(N,) that sum to 1."""
        self.effective_size = 0.0
        """How many equally weighted particles these are worth."""
        self._slips = np.zeros((len(map_from_base), 3))
        self._slip_age = np.inf
        self._effort = np.zeros(2)
        self._rng = rng
        self._set_even_weights()

    def __len__(self) -> int:
        return len(self.map_from_base)

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
            random_seed(self._rng),
        )
        if slip > 0.0 and isfinite(step.travel):
            x, y, turn = step.base_from_next_base.tolist()
            distance_scale, turn_scale = slip_scale.tolist()
            distance = distance_scale * hypot(x, y)
            self.inject(np.array([distance, distance, turn_scale * abs(turn)]))

    def inject(self, deviations: Pose) -> None:
        """Let a few particles take the odometry for all wrong, by deviations (3,) in metres and radians.

        Wheels spin, cars bump and are pushed.
        """
        self._disturb(self._first_injected(), _INJECTION_INTERVAL, deviations)

    def propose(self, map_from_base: Pose, covariance: NDArray[np.float64]) -> None:
        """Let a few particles stand about another opinion (3,) of the place, with its covariance (3, 3).

        The next scan weighs them against the rest.
        """
        first = self._first_injected()
        self.map_from_base[first::_INJECTION_INTERVAL] = map_from_base
        self._disturb(first, _INJECTION_INTERVAL, np.sqrt(np.diag(covariance)))

    def weigh(self, log_likelihood: NDArray[np.float64], most: float = inf) -> None:
        """Take in how well each particle (N,) explains a scan, which counts by ``most`` against any."""
        self.weights, self.effective_size = take_evidence(self._log_weights, log_likelihood, most)

    def weigh_next(self, log_likelihood: NDArray[np.float64], travel: float) -> None:
        """The same of a scan so many metres plus radians after the last one."""
        most = min(max(_EVIDENCE_PER_TRAVEL * travel, _LEAST_EVIDENCE), _MOST_EVIDENCE)
        self.weigh(log_likelihood, most)

    def spread(self, deviations: Pose) -> None:
        """Disturb all particles by deviations (3,) in metres and radians, so that copies of one differ."""
        self._disturb(0, 1, deviations)

    def moments(self) -> tuple[Pose, NDArray[np.float64], float]:
        """Mean (3,), covariance (3, 3) and weight of the heaviest cluster."""
        return cluster_moments(self.map_from_base, self.weights, *CLUSTER_SIZES)

    @property
    def lag(self) -> float:
        """By how much the car is thought to be behind what its odometry says, see `slip_kernels`."""
        return float(self.weights @ self._slips[:, 2])

    def resample(self, count: int) -> None:
        """Draw so many particles anew when too few are effective, or there are more."""
        if self.effective_size >= _RESAMPLE_BELOW * len(self) and len(self) <= count:
            return
        chosen = systematic_resample(self.weights, count, self._rng)
        self.map_from_base, self._slips = take_rows(self.map_from_base, self._slips, chosen)
        self._set_even_weights()

    def _first_injected(self) -> int:
        """Number of the first of the few, drawn anew so that each particle has its turn."""
        return int(_INJECTION_INTERVAL * self._rng.random())

    def _disturb(self, first: int, interval: int, deviations: Pose) -> None:
        disturb_particles(self.map_from_base, first, interval, deviations, random_seed(self._rng))

    def _set_even_weights(self) -> None:
        self._log_weights = np.zeros(len(self))
        self.weights = np.full(len(self), 1.0 / len(self))
        self.effective_size = float(len(self))
