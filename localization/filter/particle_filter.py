"""The particle filter: predict, weigh, tell the dominant cluster, resample."""

from math import hypot, isfinite

import numpy as np
from numpy.typing import NDArray

from racecar.localization.filter.adaptive_count import needed_particles
from racecar.localization.filter.cluster_kernels import cluster_moments
from racecar.localization.filter.resampling import systematic_resample
from racecar.localization.filter.resampling_kernels import take_rows
from racecar.localization.filter.weights_kernels import take_evidence
from racecar.localization.numerics.noise_kernels import random_seed
from racecar.localization.odometry.motion_model import MotionModel
from racecar.localization.odometry.motion_model_kernels import disturb_particles
from racecar.localization.odometry.motion_step import MotionStep
from racecar.localization.odometry.slip import changed_slips
from racecar.maps.geometry.se2 import Pose

_EVIDENCE_PER_TRAVEL, _LEAST_EVIDENCE, _MOST_EVIDENCE = 40.0, 2.0, 6.0
"""Log-likelihood by which one scan tells against a particle at most, per metre plus radian since the last.
What the map has wrong disturbs scans taken near each other alike; a cloud that heeded all of them would leave
what the odometry says for where that seems explained by chance."""
_ONE_STRAY_IN = 20
_SLIPS_CHANGE_AFTER = 0.1
"""Seconds; in shorter ones the slips keep."""
_FULL_DOUBT = np.ones(2)


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

    def predict(
        self, step: MotionStep, model: MotionModel, slip: float, doubt: NDArray[np.float64] = _FULL_DOUBT
    ) -> None:
        """Move all particles by a step, each by its own guess of how that was measured wrongly.

        The guesses of the slip last for a while, so that the filter learns it. Where wheels can slip at all,
        a few particles stray. ``doubt`` (2,), 0 to 1, is how much of either way and turn of this car's
        odometry deserve.
        """
        if step.travel == 0.0:
            return
        self._slip_age += step.seconds
        self._effort = np.maximum(self._effort, step.effort)
        if self._slip_age >= _SLIPS_CHANGE_AFTER:
            self._slips = changed_slips(self._slips, self._slip_age, self._effort, slip * doubt, self._rng)
            self._slip_age, self._effort = 0.0, np.zeros(2)
        self.map_from_base = model.move(self.map_from_base, self._slips, step, self._rng)
        if slip > 0.0 and isfinite(step.travel):
            x, y, turn = step.base_from_next_base.tolist()
            way_doubt, turn_doubt = doubt.tolist()
            path = way_doubt * hypot(x, y)
            self.stray(np.array([path, path, turn_doubt * abs(turn)]))

    def stray(self, deviations: Pose) -> None:
        """Let a few particles think that the odometry is all wrong by deviations (3,) in metres and radians.

        Wheels spin, cars bump and are pushed.
        """
        self._disturb(self._choose_strays(), deviations)

    def propose(self, map_from_base: Pose, covariance: NDArray[np.float64]) -> None:
        """Let a few particles stand about another opinion (3,) of the place, with its covariance (3, 3).

        The next scan weighs them against the rest.
        """
        first = self._choose_strays()
        self.map_from_base[first::_ONE_STRAY_IN] = map_from_base
        self._disturb(first, np.sqrt(np.diag(covariance)))

    def weigh(self, log_likelihood: NDArray[np.float64], travel: float) -> None:
        """Take in how well each particle (N,) explains a scan, so many metres plus radians after the last."""
        most = min(max(_EVIDENCE_PER_TRAVEL * travel, _LEAST_EVIDENCE), _MOST_EVIDENCE)
        self.weights, self.effective_size = take_evidence(self._log_weights, log_likelihood, most)

    def moments(self) -> tuple[Pose, NDArray[np.float64], float]:
        """Mean (3,), covariance (3, 3) and weight of the heaviest cluster."""
        return cluster_moments(self.map_from_base, self.weights)

    @property
    def lag(self) -> float:
        """By how much the car is thought to be behind what its odometry says, see `slip`."""
        return float(self.weights @ self._slips[:, 2])

    def resample(self, fewest: int, most: int) -> None:
        """Draw particles anew when under half are effective, or there are too many.

        As many as their spread asks for, between the fewest and the most.
        """
        if self.effective_size >= 0.5 * len(self) and len(self) <= most:
            return
        count = needed_particles(self.map_from_base, self.weights, fewest, most)
        chosen = systematic_resample(self.weights, count, self._rng)
        self.map_from_base, self._slips = take_rows(self.map_from_base, self._slips, chosen)
        self._set_even_weights()

    def _choose_strays(self) -> int:
        """The first of them."""
        return int(_ONE_STRAY_IN * self._rng.random())

    def _disturb(self, first: int, deviations: Pose) -> None:
        disturb_particles(self.map_from_base, first, _ONE_STRAY_IN, deviations, random_seed(self._rng))

    def _set_even_weights(self) -> None:
        self._log_weights = np.zeros(len(self))
        self.weights = np.full(len(self), 1.0 / len(self))
        self.effective_size = float(len(self))
