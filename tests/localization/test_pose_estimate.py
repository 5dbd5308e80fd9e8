import numpy as np

from localization.particle_filter import ParticleFilter
from localization.pose_estimate import mean_and_covariance


def test_mean_heading_across_the_seam() -> None:
    poses = np.array([[0.0, 0.0, np.pi - 0.1], [1.0, 0.0, -np.pi + 0.1]])
    mean, covariance = mean_and_covariance(poses, np.array([0.5, 0.5]))
    assert np.isclose(abs(mean[2]), np.pi)
    np.testing.assert_allclose(np.diag(covariance), [0.25, 0.0, 0.01], atol=1e-9)


def test_the_heavier_of_two_clusters_is_the_estimate() -> None:
    rng = np.random.default_rng(0)
    here, there = rng.normal([0, 0, 0], 0.1, (600, 3)), rng.normal([5, 0, 1], 0.1, (400, 3))
    filter = ParticleFilter(np.concatenate([here, there]), rng)
    estimate = filter.estimate(7, is_start=False, lost_probability=0.0)
    np.testing.assert_allclose(estimate.map_from_base, 0.0, atol=0.05)
    assert np.isclose(estimate.cluster_weight, 0.6, atol=0.01)
    filter.weigh(np.where(np.arange(1000) < 600, 0.0, 2.0))
    estimate = filter.estimate(8, is_start=False, lost_probability=0.0)
    np.testing.assert_allclose(estimate.map_from_base, [5.0, 0.0, 1.0], atol=0.05)


def test_the_most_unlikely_scans_do_not_make_weights_vanish() -> None:
    filter = ParticleFilter(np.zeros((4, 3)), np.random.default_rng(0))
    for _ in range(100):
        filter.weigh(np.array([-1e5, -1e5, -1e5 - 1.0, -2e5]))
    np.testing.assert_allclose(filter.weights, [0.5, 0.5, 0.0, 0.0], atol=1e-9)


def test_resampling_only_when_under_half_are_effective() -> None:
    filter = ParticleFilter(np.arange(12.0).reshape(4, 3), np.random.default_rng(0))
    before = filter.map_from_base
    filter.weigh(np.log([0.4, 0.3, 0.2, 0.1]))
    filter.resample(4)
    assert filter.map_from_base is before
    filter.weigh(np.array([0.0, -9.0, -9.0, -9.0]))
    filter.resample(4)
    np.testing.assert_array_equal(filter.map_from_base, np.tile(before[0], (4, 1)))
    np.testing.assert_allclose(filter.weights, 0.25)
