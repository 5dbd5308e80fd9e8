"""The particle filter: predict, weigh, tell the dominant cluster, resample."""

import numpy as np
from numpy.typing import NDArray

from localization.adaptive_count import needed_particles
from localization.motion_model import MotionModel
from localization.motion_source import MotionStep
from localization.pose_estimate_kernels import cluster_moments
from localization.resampling import effective_sample_size, systematic_resample
from localization.tempering import LogLikelihood
from maps.se2 import Pose

_ONE_STRAY_IN = 100
_STRAY = np.array([0.3, 0.3, 0.15])
"""Standard deviations in metres and radians."""


class ParticleFilter:
    """Weighted guesses of the pose; weights are kept as logarithms, so that no scan makes them vanish."""

    def __init__(self, map_from_base: Pose, rng: np.random.Generator) -> None:
        self.map_from_base = map_from_base
        """(N, 3)"""
        self.weights: NDArray[np.float64] = np.empty(0)
        """(N,) that sum to 1."""
        self._rng = rng
        self._set_even_weights()

    def __len__(self) -> int:
        return len(self.map_from_base)

    def predict(self, step: MotionStep, model: MotionModel) -> None:
        """Move all particles by a step, each by its own guess of how that was measured wrongly."""
        self.map_from_base = model.move(
            self.map_from_base, step.base_from_next_base, step.deviations, self._rng
        )

    def explain(self, log_likelihood: LogLikelihood) -> NDArray[np.float64]:
        """(N,) how well each particle explains what was measured; a few first try to do so better elsewhere.

        Many scans that agree make the cloud so narrow that what the map lacks can lead it astray; a stray
        that is right draws it back.
        """
        strays = self._rng.integers(len(self), size=-(-len(self) // _ONE_STRAY_IN))
        places = self.map_from_base[strays] + _STRAY * self._rng.standard_normal((len(strays), 3))
        both = log_likelihood(np.concatenate([self.map_from_base, places]))
        explained, proposed = both[: len(self)], both[len(self) :]
        is_better = proposed > explained[strays]
        explained[strays[is_better]] = proposed[is_better]
        self.map_from_base = self.map_from_base.copy()
        self.map_from_base[strays[is_better]] = places[is_better]
        return explained

    def weigh(self, log_likelihood: NDArray[np.float64]) -> None:
        """Take in how well each particle (N,) explains what was measured."""
        self._log_weights += log_likelihood
        self._log_weights -= self._log_weights.max()
        self.weights = np.exp(self._log_weights)
        self.weights /= self.weights.sum()

    def moments(self) -> tuple[Pose, NDArray[np.float64], float]:
        """Mean (3,), covariance (3, 3) and weight of the heaviest cluster."""
        return cluster_moments(self.map_from_base, self.weights)

    @property
    def effective_size(self) -> float:
        """How many equally weighted particles these are worth."""
        return effective_sample_size(self.weights)

    def resample(self, fewest: int, most: int) -> None:
        """Draw particles anew when under half are effective, or there are too many.

        As many as their spread asks for, between the fewest and the most.
        """
        if self.effective_size >= 0.5 * len(self) and len(self) <= most:
            return
        count = most if fewest >= most else needed_particles(self.map_from_base, self.weights, fewest, most)
        self.map_from_base = self.map_from_base[systematic_resample(self.weights, count, self._rng)]
        self._set_even_weights()

    def _set_even_weights(self) -> None:
        self._log_weights = np.zeros(len(self))
        self.weights = np.full(len(self), 1.0 / len(self))
