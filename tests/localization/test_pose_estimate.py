import numpy as np

from racecar.localization.filter.cluster_kernels import cluster_moments
from racecar.localization.filter.particle_filter import CLUSTER_SIZES, ParticleFilter


def test_mean_heading_across_the_seam() -> None:
    poses = np.array([[0.0, 0.0, np.pi - 0.1], [0.9, 0.0, -np.pi + 0.1]])
    mean, covariance, weight = cluster_moments(poses, np.array([0.5, 0.5]), *CLUSTER_SIZES)
    assert np.isclose(abs(mean[2]), np.pi)
    np.testing.assert_allclose(np.diag(covariance), [0.2025, 0.0, 0.01], atol=1e-9)
    assert weight == 1.0


def test_the_covariance_is_that_of_the_weighted_cloud() -> None:
    rng = np.random.default_rng(0)
    poses, weights = (
        rng.multivariate_normal(np.ones(3), np.diag([0.01, 0.02, 0.005]) + 0.004, 500),
        rng.random(500),
    )
    mean, covariance, _ = cluster_moments(poses, weights / weights.sum(), *CLUSTER_SIZES)
    np.testing.assert_allclose(mean, np.average(poses, axis=0, weights=weights), atol=1e-3)
    np.testing.assert_allclose(covariance, np.cov(poses.T, aweights=weights, ddof=0), atol=1e-5)


def test_the_heavier_of_two_clusters_is_the_estimate() -> None:
    rng = np.random.default_rng(0)
    here, there = rng.normal([0, 0, 0], 0.1, (600, 3)), rng.normal([5, 0, 1], 0.1, (400, 3))
    filter = ParticleFilter(np.concatenate([here, there]), rng)
    mean, _, weight = filter.moments()
    np.testing.assert_allclose(mean, 0.0, atol=0.05)
    assert np.isclose(weight, 0.6, atol=0.01)
    filter.weigh_next(np.where(np.arange(1000) < 600, 0.0, 2.0), 1.0)
    mean, _, _ = filter.moments()
    np.testing.assert_allclose(mean, [5.0, 0.0, 1.0], atol=0.05)


def test_those_who_face_the_other_way_at_the_same_place_are_another_cluster() -> None:
    rng = np.random.default_rng(0)
    ahead, back = rng.normal([2, 1, 0.3], 0.05, (700, 3)), rng.normal([2, 1, 0.3 - np.pi], 0.05, (300, 3))
    mean, covariance, weight = ParticleFilter(np.concatenate([ahead, back]), rng).moments()
    np.testing.assert_allclose(mean, [2.0, 1.0, 0.3], atol=0.02)
    assert covariance[2, 2] < 0.01
    assert np.isclose(weight, 0.7, atol=0.01)


def test_the_most_unlikely_scans_do_not_make_weights_vanish() -> None:
    filter = ParticleFilter(np.zeros((4, 3)), np.random.default_rng(0))
    for _ in range(100):
        filter.weigh_next(np.array([-1e5, -1e5, -1e5 - 1.0, -2e5]), 1.0)
    np.testing.assert_allclose(filter.weights, [0.5, 0.5, 0.0, 0.0], atol=1e-9)


def test_resampling_only_when_under_half_are_effective() -> None:
    filter = ParticleFilter(np.arange(12.0).reshape(4, 3), np.random.default_rng(0))
    before = filter.map_from_base
    filter.weigh_next(np.log([0.4, 0.3, 0.2, 0.1]), 1.0)
    filter.resample(4)
    assert filter.map_from_base is before
    filter.weigh_next(np.array([0.0, -9.0, -9.0, -9.0]), 1.0)
    filter.resample(4)
    np.testing.assert_array_equal(filter.map_from_base, np.tile(before[0], (4, 1)))
    np.testing.assert_allclose(filter.weights, 0.25)
