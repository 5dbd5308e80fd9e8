"""From a wide cloud to the places that explain the first scan, without losing the right one on the way.

A scan is far sharper than the first cloud is dense: weighed at once, a handful of particles that happen to
lie near would take all. So its likelihood L is raised step by step from L^0 to L^1; after each step the cloud
is resampled and every particle tries a small random move, accepted by the rule of Metropolis, which keeps the
distribution and fills the likely places with particles that differ.
Del Moral, Doucet, Jasra: Sequential Monte Carlo samplers, J. R. Stat. Soc. B 68 (2006).
"""

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from racecar.localization.filter.adaptive_count_kernels import needed_particles
from racecar.localization.filter.config import AdaptiveCountConfig, TemperingConfig
from racecar.localization.filter.resampling_kernels import systematic_resample
from racecar.maps.geometry.se2 import Pose

LogLikelihood = Callable[[Pose], NDArray[np.float64]]
_Number = TypeVar("_Number", np.float32, np.float64)

_EXACT = 0.01
"""Share of itself to which a step is found: exact enough, since a step need not be of just that length."""


def temper(
    map_from_base: Pose,
    log_likelihood: LogLikelihood,
    fewest: int,
    most: int,
    config: TemperingConfig,
    count_config: AdaptiveCountConfig,
    rng: np.random.Generator,
) -> Pose:
    """(M, 3) particles that follow the likelihood, from (N, 3) that are spread out more widely.

    As many as their spread asks for, between the fewest and the most.
    """
    particles, likelihood, reached = map_from_base, log_likelihood(map_from_base), 0.0
    while reached < 1.0:
        wanted_size = config.effective_share * min(most, len(particles))
        step = _next_step(likelihood, 1.0 - reached, wanted_size)
        reached += step
        weights = likelihood_weights(likelihood, step)
        count = needed_particles(particles, weights, fewest, most, count_config)
        chosen = systematic_resample(weights, count, rng)
        particles, likelihood = particles[chosen], likelihood[chosen]
        for _ in range(config.moves):
            particles, likelihood = _try_moves(particles, likelihood, log_likelihood, reached, config, rng)
    return particles


def likelihood_weights(log_likelihood: NDArray[_Number], power: float) -> NDArray[_Number]:
    """(N,) that sum to 1, by the likelihood (N,) to a power."""
    weights: NDArray[_Number] = np.exp(power * (log_likelihood - log_likelihood.max()))
    weights /= weights.sum()
    return weights


def effective_sample_size(weights: NDArray[np.float64]) -> float:
    """How many equally weighted particles weights (N,) that sum to 1 are worth, 1 to N."""
    return float(1.0 / np.dot(weights, weights))


def _next_step(log_likelihood: NDArray[np.float64], longest: float, wanted_size: float) -> float:
    """How much more of the likelihood leaves an effective sample of the wanted size."""

    def surplus(step: float) -> float:
        return effective_sample_size(likelihood_weights(log_likelihood, step)) - wanted_size

    if surplus(longest) >= 0.0:
        return longest
    return float(brentq(surplus, 0.0, longest, xtol=1e-4 * longest, rtol=_EXACT))


def _try_moves(
    particles: Pose,
    current: NDArray[np.float64],
    log_likelihood: LogLikelihood,
    reached: float,
    config: TemperingConfig,
    rng: np.random.Generator,
) -> tuple[Pose, NDArray[np.float64]]:
    scale = min(1.0 / np.sqrt(reached), config.widest)
    widths = np.array([config.move, config.move, config.turn])
    moved = particles + scale * widths * rng.standard_normal(particles.shape)
    proposed = log_likelihood(moved)
    accepted = np.log(rng.random(len(particles))) < reached * (proposed - current)
    return np.where(accepted[:, None], moved, particles), np.where(accepted, proposed, current)
