import numpy as np

from racecar.localization.filter.particle_filter import ParticleFilter, cluster_moments
from racecar.maps.geometry.se2 import between, wrap_angle


def test_mean_heading_across_the_seam() -> None:
    poses = np.array([[0.0, 0.0, np.pi - 0.1], [0.9, 0.0, -np.pi + 0.1]])
    mean, covariance, weight = cluster_moments(poses, np.array([0.5, 0.5]))
    assert np.isclose(abs(mean[2]), np.pi)
    np.testing.assert_allclose(np.diag(covariance), [0.2025, 0.0, 0.01], atol=1e-9)
    assert weight == 1.0


def test_the_covariance_is_that_of_the_weighted_cloud() -> None:
    rng = np.random.default_rng(0)
    poses, weights = (
        rng.multivariate_normal(np.ones(3), np.diag([0.01, 0.02, 0.005]) + 0.004, 500),
        rng.random(500),
    )
    mean, covariance, _ = cluster_moments(poses, weights / weights.sum())
    np.testing.assert_allclose(mean, np.average(poses, axis=0, weights=weights), atol=1e-3)
    np.testing.assert_allclose(covariance, np.cov(poses.T, aweights=weights, ddof=0), atol=1e-5)


def test_the_heavier_of_two_clusters_is_the_estimate() -> None:
    rng = np.random.default_rng(0)
    here, there = rng.normal([0, 0, 0], 0.1, (600, 3)), rng.normal([5, 0, 1], 0.1, (400, 3))
    filter = ParticleFilter(np.concatenate([here, there]), rng)
    mean, _, weight = filter.moments()
    np.testing.assert_allclose(mean, 0.0, atol=0.05)
    assert np.isclose(weight, 0.6, atol=0.01)
    filter.weigh(np.where(np.arange(1000) < 600, 0.0, 2.0), 1.0)
    mean, _, _ = filter.moments()
    np.testing.assert_allclose(mean, [5.0, 0.0, 1.0], atol=0.05)


def test_those_who_face_the_other_way_at_the_same_place_are_another_cluster() -> None:
    rng = np.random.default_rng(0)
    ahead, back = rng.normal([2, 1, 0.3], 0.05, (700, 3)), rng.normal([2, 1, 0.3 - np.pi], 0.05, (300, 3))
    mean, covariance, weight = ParticleFilter(np.concatenate([ahead, back]), rng).moments()
    np.testing.assert_allclose(mean, [2.0, 1.0, 0.3], atol=0.02)
    assert covariance[2, 2] < 0.01
    assert np.isclose(weight, 0.7, atol=0.01)


def test_where_squares_and_sectors_end_does_not_matter() -> None:
    """To a cloud that may lie on such an edge, beside three lighter ones that do not."""
    rng, places = np.random.default_rng(0), np.array([[0.0, 0.0, 0.1], [9.1, 0.1, 0.1], [0.1, 9.1, 0.1]])
    others = places.repeat(100, axis=0)
    for center in rng.uniform([4.0, 4.0, -np.pi], [6.0, 6.0, np.pi], (40, 3)):
        cloud = rng.normal(center, [0.05, 0.05, 0.02], (200, 3))
        poses = np.concatenate([others, cloud])
        poses[:, 2] = wrap_angle(poses[:, 2])
        mean, _, weight = cluster_moments(poses, np.full(500, 1 / 500))
        np.testing.assert_allclose(between(center, mean), 0.0, atol=0.05)
        assert np.isclose(weight, 0.4)


def test_a_first_particle_that_weighs_nothing_has_no_say() -> None:
    poses = np.array([[0.0, 0.0, 0.0], [9.0, 0.0, 1.0], [9.2, 0.0, 1.0]])
    mean, _, weight = cluster_moments(poses, np.array([0.0, 0.5, 0.5]))
    np.testing.assert_allclose(mean, [9.1, 0.0, 1.0])
    assert weight == 1.0
