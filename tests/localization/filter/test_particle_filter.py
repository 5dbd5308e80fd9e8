import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from racecar.localization.config import LocalizationConfig
from racecar.localization.filter.particle_filter import ParticleFilter
from racecar.localization.odometry.motion_model import MotionStep, odometry_deviations
from racecar.localization.recovery.perception import Perception
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose
from tests.localization.scans import points_at, ranges_from
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


log_likelihoods = st.lists(st.floats(-1e4, 1e4), min_size=8, max_size=8)


@given(st.lists(log_likelihoods, min_size=1, max_size=20))
@example([[0.0] * 7 + [6.0]] * 7)
def test_weights_sum_to_one_and_none_vanishes_at_once(scans: list[list[float]]) -> None:
    filter = ParticleFilter(np.zeros((8, 3)), np.random.default_rng(0))
    for scan in scans:
        before = filter.weights
        filter.weigh(np.array(scan), 1.0)
        assert filter.weights.sum() == pytest.approx(1.0)
        assert 1.0 - 1e-9 <= filter.effective_size <= 8.0 + 1e-9
        assert np.all(filter.weights >= before * np.exp(-6.0) * (1 - 1e-7))


def test_weights_multiply_up() -> None:
    filter = ParticleFilter(np.zeros((3, 3)), np.random.default_rng(0))
    first, second = np.array([-1.0, -2.0, -3.0]), np.array([-500.0, -500.5, -498.0])
    filter.weigh(first, 1.0)
    filter.weigh(second, 1.0)
    expected = np.exp(first + second - (first + second).max())
    np.testing.assert_allclose(filter.weights, expected / expected.sum())


@given(
    arrays(np.float64, 12, elements=st.floats(-30.0, 0.0)),
    arrays(np.float64, 12, elements=st.floats(-1e6, 0.0)),
    st.floats(0.0, 0.2),
)
def test_weights_are_those_of_bayes_rule(first: np.ndarray, second: np.ndarray, travel: float) -> None:
    filter = ParticleFilter(np.zeros((12, 3)), np.random.default_rng(0))
    filter.weigh(first)
    filter.weigh(second, travel)
    share = min(travel / 0.1, 1.0)
    expected = np.exp(first - first.max() + np.maximum(share * (second - second.max()), -6.0))
    expected /= expected.sum()
    np.testing.assert_allclose(filter.weights, expected, rtol=1e-7)
    np.testing.assert_allclose(filter.effective_size, 1.0 / (expected @ expected), rtol=1e-7)


def test_a_first_scan_may_rule_particles_out() -> None:
    filter = ParticleFilter(np.zeros((3, 3)), np.random.default_rng(0))
    filter.weigh(np.array([-5000.0, 0.0, 0.0]))
    np.testing.assert_array_equal(filter.weights, [0.0, 0.5, 0.5])


def test_the_most_unlikely_scans_do_not_make_weights_vanish() -> None:
    filter = ParticleFilter(np.zeros((4, 3)), np.random.default_rng(0))
    for _ in range(100):
        filter.weigh(np.array([-1e5, -1e5, -1e5 - 1.0, -2e5]), 1.0)
    np.testing.assert_allclose(filter.weights, [0.5, 0.5, 0.0, 0.0], atol=1e-9)


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


def test_resampling_only_when_under_half_are_effective() -> None:
    filter = ParticleFilter(np.arange(12.0).reshape(4, 3), np.random.default_rng(0))
    before = filter.map_from_base
    filter.weigh(np.log([0.4, 0.3, 0.2, 0.1]), 1.0)
    filter.resample(4)
    assert filter.map_from_base is before
    filter.weigh(np.array([0.0, -9.0, -9.0, -9.0]), 1.0)
    filter.resample(4)
    np.testing.assert_array_equal(filter.map_from_base, np.tile(before[0], (4, 1)))
    np.testing.assert_allclose(filter.weights, 0.25)
