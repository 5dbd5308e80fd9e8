import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from racecar.localization.config import LocalizationConfig
from racecar.localization.filter.particle_filter import ParticleFilter, cluster_moments, systematic_resample
from racecar.localization.filter.particle_kernels import move_particles
from racecar.localization.odometry.motion_model import MotionStep, odometry_deviations
from racecar.localization.recovery.perception import Perception
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose, wrap_angle
from tests.localization.scenes import points_at, ranges_from
from tests.sensors.drives import room

SLIP = 0.3


def forward(metres: float) -> MotionStep:
    increment = np.array([metres, 0.0, 0.0])
    return MotionStep(increment, odometry_deviations(increment, LocalizationConfig()), abs(metres), 0.025)


def filter_at(pose: Pose, count: int = 4000, seed: int = 0) -> ParticleFilter:
    rng = np.random.default_rng(seed)
    return ParticleFilter(pose + [0.02, 0.02, 0.01] * rng.standard_normal((count, 3)), rng)


def test_most_particles_follow_the_odometry_and_a_few_do_not() -> None:
    filter = ParticleFilter(np.zeros((4000, 3)), np.random.default_rng(0))
    filter.predict(forward(0.5), SLIP)
    is_injected = np.abs(filter.map_from_base[:, 0] - 0.5) > 0.1
    assert 0.03 < is_injected.mean() <= 0.05
    assert filter.map_from_base[:, 0].min() < -0.5
    assert np.median(filter.map_from_base[:, 0]) == pytest.approx(0.5, abs=0.005)


def test_other_particles_are_injected_every_time() -> None:
    filter = ParticleFilter(np.zeros((2000, 3)), np.random.default_rng(0))
    was_injected = np.zeros(2000, dtype=np.bool_)
    for _ in range(60):
        before = filter.map_from_base[:, 0].copy()
        filter.predict(forward(0.5), SLIP)
        was_injected |= np.abs(filter.map_from_base[:, 0] - before - 0.5) > 0.1
    assert was_injected.mean() > 0.5


@settings(max_examples=30)
@given(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.integers(10, 300))
def test_where_nothing_slips_the_cloud_moves_by_the_step(x: float, y: float, turn: float, count: int) -> None:
    step = MotionStep(np.array([x, y, turn]), np.zeros(3), abs(x) + abs(y) + abs(turn), 0.025)
    start = np.array([1.0, 2.0, 0.7])
    filter = ParticleFilter(np.tile(start, (count, 1)), np.random.default_rng(0))
    filter.predict(step, 0.0)
    off = np.abs(between(compose(start, step.base_from_next_base), filter.map_from_base))
    assert off.max() < 1e-9


def test_a_car_that_stands_leaves_the_cloud_as_it_is() -> None:
    filter = filter_at(IDENTITY)
    before = filter.map_from_base.copy()
    filter.predict(MotionStep(IDENTITY, np.zeros(3), 0.0, 0.1), SLIP)
    np.testing.assert_array_equal(filter.map_from_base, before)


def test_the_cloud_follows_a_car_that_drives_backward_while_its_odometry_says_forward() -> None:
    """Usually: after one drive in six it has not come back to the car yet."""
    errors = np.array([errors_driving_backward(seed) for seed in range(7)])
    most, last = np.median([errors.max(axis=1), errors[:, -1]], axis=1)
    assert most < 0.9
    assert last < 0.06


def errors_driving_backward(seed: int) -> list[float]:
    """Metres after each scan."""
    grid, rng = room(), np.random.default_rng(seed)
    perception = Perception(grid)
    truth = compose(grid.map_from_grid, [9.0, 4.0, 0.7])
    filter = filter_at(truth, seed=seed)
    off = []
    for scan in range(48):
        is_told_wrongly = 8 <= scan < 24
        truth = compose(truth, [-0.05 if is_told_wrongly else 0.02, 0.0, 0.0])
        filter.predict(forward(0.05 if is_told_wrongly else 0.02), SLIP)
        points = points_at(ranges_from(grid, truth) + 0.01 * rng.standard_normal(271)).thinned(100)
        filter.weigh(perception.log_likelihood(filter.map_from_base, points), 0.15)
        mean, _, _ = filter.moments()
        off.append(float(np.hypot(*(mean - truth)[:2])))
        filter.resample(4000)
    return off


@settings(max_examples=50)
@given(
    st.lists(
        st.tuples(arrays(np.float64, 8, elements=st.floats(-1e6, 1e4)), st.floats(0.0, 1.0)),
        min_size=1,
        max_size=20,
    )
)
@example([(np.array([0.0] * 7 + [6.0]), 1.0)] * 7)
@example([(np.array([-1e5, -1e5, -1e5 - 1.0, -2e5] * 2), 1.0)] * 100)
@example(
    [(np.array([-1.0, -2.0, -3.0, -1.0] * 2), 1.0), (np.array([-500.0, -500.5, -498.0, -500.0] * 2), 1.0)]
)
def test_weights_are_those_of_bayes_rule(scans: list[tuple[np.ndarray, float]]) -> None:
    """A first scan may rule particles out; later ones count by how far they are, and none at once for all."""
    filter = ParticleFilter(np.zeros((8, 3)), np.random.default_rng(0))
    log_weights = np.zeros(8)
    for number, (seen, travel) in enumerate(scans):
        filter.weigh(seen, travel if number else None)
        gain = seen - seen.max()
        log_weights += np.maximum(min(travel / 0.1, 1.0) * gain, -6.0) if number else gain
        expected = np.exp(log_weights - log_weights.max())
        expected /= expected.sum()
        np.testing.assert_allclose(filter.weights, expected, rtol=1e-7, atol=1e-300)
        np.testing.assert_allclose(filter.effective_size, 1.0 / (expected @ expected), rtol=1e-7)


def test_it_is_resampled_only_when_few_are_effective_or_there_are_too_many() -> None:
    filter = filter_at(IDENTITY, count=1000)
    filter.weigh(np.where(np.arange(1000) < 600, 0.0, -6.0), 1.0)
    before = filter.map_from_base
    filter.resample(1000)
    assert filter.map_from_base is before
    filter.resample(900)
    assert len(filter) == 900
    filter = filter_at(IDENTITY, count=1000)
    filter.weigh(np.where(np.arange(1000) < 300, 0.0, -6.0), 1.0)
    heavy = filter.map_from_base[:300]
    filter.resample(1000)
    assert len(filter) == 1000
    assert filter.effective_size == pytest.approx(1000.0)
    assert np.isin(filter.map_from_base[:, 0], heavy[:, 0]).mean() > 0.98


def test_a_slip_that_explains_the_scans_is_learned() -> None:
    """Wheels that always tell a tenth too much: particles that think so stay, and foresee the next step."""
    filter = ParticleFilter(np.zeros((4000, 3)), np.random.default_rng(0))
    ahead = []
    truth = 0.0
    for _ in range(150):
        truth += 0.045
        filter.predict(forward(0.05), SLIP)
        ahead.append(np.average(filter.map_from_base[:, 0], weights=filter.weights) - truth)
        filter.weigh(-0.5 * ((filter.map_from_base[:, 0] - truth) / 0.02) ** 2, 0.05)
        filter.resample(4000)
    assert np.mean(ahead[-50:]) < 0.5 * np.mean(ahead[:10])


def test_the_cloud_learns_how_far_a_car_is_behind_its_odometry() -> None:
    """Of the particles, those that were behind by as much as the car are left."""
    filter = ParticleFilter(np.zeros((4000, 3)), np.random.default_rng(0))
    behind = np.array([-0.02, 0.0, -0.05])
    truth = IDENTITY
    for _ in range(20):
        increment = np.array([0.05, 0.0, 0.05])
        filter.predict(MotionStep(increment, np.zeros(3), 0.1, 0.025, behind=behind), SLIP)
        truth = compose(truth, increment + 1.2 * behind)
        off = np.abs(between(truth, filter.map_from_base)).max(axis=1)
        filter.weigh(-0.5 * (off / 0.03) ** 2, 0.1)
        filter.resample(4000)
    unbiased, _, _ = filter.moments()
    filter.predict(MotionStep(increment, np.zeros(3), 0.1, 0.025, behind=behind), SLIP)
    moved = between(unbiased, np.median(filter.map_from_base, axis=0))
    assert moved[2] == pytest.approx(0.05 - 1.2 * 0.05, abs=0.015)


unnormalized = arrays(np.float64, st.integers(1, 60), elements=st.floats(0.0, 1.0)).filter(
    lambda weights: weights.sum() > 1e-6
)


@given(unnormalized, st.integers(1, 200), st.integers(0, 2**32))
def test_each_particle_is_taken_as_often_as_its_weight_says(
    weights: np.ndarray, count: int, seed: int
) -> None:
    weights = weights / weights.sum()
    indices = systematic_resample(weights, count, np.random.default_rng(seed))
    taken = np.bincount(indices, minlength=len(weights))
    assert len(indices) == count
    assert np.all(np.abs(taken - weights * count) < 1.0 + 1e-6)


def test_the_expected_number_of_copies_is_exact() -> None:
    weights, rng = np.array([0.15, 0.85]), np.random.default_rng(0)
    taken = [np.bincount(systematic_resample(weights, 3, rng), minlength=2) for _ in range(4000)]
    np.testing.assert_allclose(np.mean(taken, axis=0), weights * 3, atol=0.03)


coordinate = st.floats(-5.0, 5.0)
poses = st.tuples(coordinate, coordinate, st.floats(-3.1, 3.1)).map(np.array)


def move(
    map_from_base: Pose,
    slips: np.ndarray,
    increment: Pose,
    deviations: Pose = IDENTITY,
    behind: Pose = IDENTITY,
) -> Pose:
    noise = np.random.default_rng(0).standard_normal(map_from_base.shape)
    moved: Pose = move_particles(map_from_base, slips, increment, behind, deviations, noise)
    return moved


@given(poses, poses)
def test_without_noise_every_particle_moves_by_the_increment(start: np.ndarray, step: np.ndarray) -> None:
    cloud = np.tile(start, (3, 1))
    moved = move(cloud, np.zeros((3, 3)), step)
    expected = compose(start, step)
    np.testing.assert_allclose(moved[:, :2], np.tile(expected[:2], (3, 1)), atol=1e-9)
    np.testing.assert_allclose(wrap_angle(moved[:, 2] - expected[2]), 0.0, atol=1e-9)
    assert np.all((-np.pi < moved[:, 2]) & (moved[:, 2] <= np.pi))


def test_noise_lies_in_the_base_frame() -> None:
    start = np.tile([1.0, 2.0, np.pi / 2], (20_000, 1))
    step, deviations = np.array([1.0, 0.0, 0.0]), np.array([0.2, 0.01, 0.03])
    moved = move(start, np.zeros((20_000, 3)), step, deviations)
    np.testing.assert_allclose(moved.mean(axis=0), [1.0, 3.0, np.pi / 2], atol=0.01)
    np.testing.assert_allclose(moved.std(axis=0), [0.01, 0.2, 0.03], rtol=0.03)


def test_slip_stretches_the_way_and_the_turn() -> None:
    straight, bend = np.array([1.0, 0.0, 0.0]), np.array([0.1, 0.0, 0.1])
    moved = move(np.zeros((1, 3)), np.array([[-0.2, 0.5, 9.0]]), straight)
    np.testing.assert_allclose(moved[0], [0.8, 0.0, 0.0], atol=1e-9)
    moved = move(np.zeros((1, 3)), np.array([[0.0, 0.5, 9.0]]), bend)
    np.testing.assert_allclose(moved[0, 2], 0.15, atol=1e-9)


def test_each_particle_is_behind_by_its_own_share() -> None:
    step, behind = np.array([0.1, 0.0, 0.06]), np.array([-0.04, 0.0, -0.06])
    lags = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.5], [0.0, 0.0, 1.0]])
    moved = move(np.zeros((3, 3)), lags, step, behind=behind)
    np.testing.assert_allclose(np.hypot(moved[:, 0], moved[:, 1]), [0.1, 0.08, 0.06], atol=1e-4)
    np.testing.assert_allclose(moved[:, 2], [0.06, 0.03, 0.0], atol=1e-9)


def test_a_car_that_stands_still_leaves_them_where_they_are() -> None:
    cloud = np.random.default_rng(0).uniform(-1.0, 1.0, size=(50, 3))
    np.testing.assert_allclose(move(cloud, np.ones((50, 3)), IDENTITY), cloud, atol=1e-12)


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
