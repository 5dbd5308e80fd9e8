import numpy as np
from numpy.typing import NDArray

from racecar.localization.filter.config import AdaptiveCountConfig, TemperingConfig
from racecar.localization.filter.tempering import temper

CONFIGS = TemperingConfig(), AdaptiveCountConfig()


def two_peaks(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Log-likelihood with narrow peaks at (3, 0, 0), and at (-3, 0, 0) a third as likely."""
    right = np.sum(((poses - [3.0, 0.0, 0.0]) / 0.05) ** 2, axis=1)
    left = np.sum(((poses - [-3.0, 0.0, 0.0]) / 0.05) ** 2, axis=1)
    return np.logaddexp(-0.5 * right, -0.5 * left + np.log(1 / 3))


def one_peak(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    return -0.5 * np.sum((poses / 0.02) ** 2, axis=1)


def test_narrow_peaks_are_found_and_keep_their_shares() -> None:
    shares, rng = [], np.random.default_rng(0)
    for _ in range(5):
        cloud = rng.uniform([-5, -5, -np.pi], [5, 5, np.pi], (50_000, 3))
        particles = temper(cloud, two_peaks, 1000, 4000, *CONFIGS, rng)
        near = np.abs(np.abs(particles[:, 0]) - 3.0) < 0.3
        assert near.mean() > 0.99
        assert 0.03 < particles[particles[:, 0] > 0, 1].std() < 0.07
        assert len(np.unique(particles[:, 0])) > 2000
        shares.append(np.mean(particles[:, 0] > 0))
    assert abs(np.mean(shares) - 0.75) < 0.15


def test_a_flat_likelihood_leaves_the_cloud_wide() -> None:
    rng = np.random.default_rng(0)
    cloud = rng.uniform(-5, 5, (1000, 3))
    particles = temper(cloud, lambda poses: np.zeros(len(poses)), 100, 500, *CONFIGS, rng)
    assert particles.shape == (500, 3)
    assert particles[:, 0].std() > 2.5


def test_one_place_needs_few_particles() -> None:
    rng = np.random.default_rng(0)
    cloud = rng.uniform([-1, -1, -0.1], [1, 1, 0.1], (5000, 3))
    particles = temper(
        cloud, lambda poses: -0.5 * np.sum((poses / 0.02) ** 2, axis=1), 500, 5000, *CONFIGS, rng
    )
    assert 500 <= len(particles) < 2500
    np.testing.assert_allclose(particles.mean(axis=0), 0.0, atol=0.005)
    np.testing.assert_allclose(particles.std(axis=0), 0.02, rtol=0.3)
