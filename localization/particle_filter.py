"""The particle filter: predict, weigh, estimate, resample."""

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from localization.motion_model import MotionModel
from localization.motion_source import MotionStep
from localization.pose_estimate import PoseEstimate, dominant_cluster, mean_and_covariance
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
        self._log_weights = np.full(len(map_from_base), -np.log(len(map_from_base)))
        self._rng = rng

    def __len__(self) -> int:
        return len(self.map_from_base)

    @property
    def weights(self) -> NDArray[np.float64]:
        """(N,) that sum to 1."""
        weights = np.exp(self._log_weights)
        normalized: NDArray[np.float64] = weights / weights.sum()
        return normalized

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
        explained = log_likelihood(self.map_from_base)
        strays = self._rng.integers(len(self), size=-(-len(self) // _ONE_STRAY_IN))
        places = self.map_from_base[strays] + _STRAY * self._rng.standard_normal((len(strays), 3))
        proposed = log_likelihood(places)
        is_better = proposed > explained[strays]
        explained[strays[is_better]] = proposed[is_better]
        self.map_from_base = self.map_from_base.copy()
        self.map_from_base[strays[is_better]] = places[is_better]
        return explained

    def weigh(self, log_likelihood: NDArray[np.float64]) -> None:
        """Take in how well each particle (N,) explains what was measured."""
        self._log_weights += log_likelihood
        self._log_weights -= logsumexp(self._log_weights)

    def estimate(self, stamp: int, is_start: bool, lost_probability: float) -> PoseEstimate:
        """The heaviest cluster's mean, noted with the stamp, whether a search came before, and the doubt."""
        weights = self.weights
        cluster = dominant_cluster(self.map_from_base, weights)
        mean, covariance = mean_and_covariance(self.map_from_base[cluster], weights[cluster])
        return PoseEstimate(
            stamp=stamp,
            map_from_base=mean,
            covariance=covariance,
            cluster_weight=float(weights[cluster].sum()),
            effective_sample_size=effective_sample_size(weights),
            particle_count=len(self),
            is_start=is_start,
            lost_probability=lost_probability,
        )

    def resample(self, count: int) -> None:
        """Draw ``count`` particles anew when under half are effective, or there are more than ``count``."""
        weights = self.weights
        if effective_sample_size(weights) >= 0.5 * len(self) and len(self) <= count:
            return
        self.map_from_base = self.map_from_base[systematic_resample(weights, count, self._rng)]
        self._log_weights = np.full(count, -np.log(count))
