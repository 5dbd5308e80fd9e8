import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from racecar.localization.config import LocalizationConfig
from racecar.localization.odometry.motion_model import drift_deviations, odometry_deviations
from racecar.localization.odometry.motion_model_kernels import carry, move_particles
from racecar.localization.odometry.motion_step import MotionStep
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose, wrap_angle

coordinate = st.floats(-5.0, 5.0)
poses = st.tuples(coordinate, coordinate, st.floats(-3.1, 3.1)).map(np.array)

CONFIG = LocalizationConfig()
NO_SLIP = np.zeros((1, 3))


def step_of(increment: Pose, deviations: Pose = IDENTITY, behind: Pose = IDENTITY) -> MotionStep:
    return MotionStep(increment, deviations, float(np.abs(increment).sum()), 0.1, behind=behind)


def move(map_from_base: Pose, slips: np.ndarray, step: MotionStep, rng: np.random.Generator) -> Pose:
    """Particles (N, 3) after a step."""
    seed = np.uint32(rng.integers(2**32))
    moved: Pose = move_particles(
        map_from_base, slips, step.base_from_next_base, step.behind, step.deviations, seed
    )
    return moved


def exact(**alphas: float) -> LocalizationConfig:
    """No noise but what is named."""
    tiny = 1e-9
    names = ("turn_noise_per_turn", "turn_noise_per_metre", "path_noise_per_metre", "path_noise_per_turn")
    return LocalizationConfig(**{**dict.fromkeys(names, tiny), **alphas})


@given(poses, poses)
def test_without_noise_every_particle_moves_by_the_increment(start: np.ndarray, step: np.ndarray) -> None:
    cloud = np.tile(start, (3, 1))
    moved = move(cloud, np.zeros((3, 3)), step_of(step), np.random.default_rng(0))
    expected = compose(start, step)
    np.testing.assert_allclose(moved[:, :2], np.tile(expected[:2], (3, 1)), atol=1e-9)
    np.testing.assert_allclose(wrap_angle(moved[:, 2] - expected[2]), 0.0, atol=1e-9)


def test_noise_lies_in_the_base_frame() -> None:
    start = np.tile([1.0, 2.0, np.pi / 2], (20_000, 1))
    step = step_of(np.array([1.0, 0.0, 0.0]), np.array([0.2, 0.01, 0.03]))
    moved = move(start, np.zeros((20_000, 3)), step, np.random.default_rng(0))
    np.testing.assert_allclose(moved.mean(axis=0), [1.0, 3.0, np.pi / 2], atol=0.01)
    np.testing.assert_allclose(moved.std(axis=0), [0.01, 0.2, 0.03], rtol=0.03)


def test_a_car_that_stands_still_gains_no_noise() -> None:
    assert np.all(odometry_deviations(IDENTITY, CONFIG) == 0.0)
    cloud = np.random.default_rng(0).uniform(-1.0, 1.0, size=(50, 3))
    moved = move(cloud, np.ones((50, 3)), step_of(IDENTITY), np.random.default_rng(1))
    np.testing.assert_allclose(moved, cloud, atol=1e-12)


def test_motion_that_nothing_measured_goes_any_way() -> None:
    step = step_of(IDENTITY, drift_deviations(4.0, CONFIG))
    moved = move(np.zeros((5000, 3)), np.zeros((5000, 3)), step, np.random.default_rng(0))
    np.testing.assert_allclose(moved.std(axis=0), 0.4, rtol=0.05)


def test_each_alpha_says_what_it_stands_for() -> None:
    metre, radian = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, -1.0])
    for name, step, expected in (
        ("turn_noise_per_turn", radian, [0.0, 0.0, 0.3]),
        ("turn_noise_per_metre", metre, [0.0, 0.0, 0.3]),
        ("path_noise_per_metre", metre, [0.3, 0.3, 0.0]),
        ("path_noise_per_turn", radian, [0.3, 0.3, 0.0]),
    ):
        np.testing.assert_allclose(odometry_deviations(step, exact(**{name: 0.3})), expected, atol=1e-8)


def test_noise_does_not_depend_on_the_number_of_steps() -> None:
    config = exact(path_noise_per_metre=0.02, turn_noise_per_metre=0.02)
    once = odometry_deviations(np.array([4.0, 0.0, 0.0]), config)
    np.testing.assert_allclose(once[[0, 2]], 0.04)
    in_steps = np.sqrt(16 * odometry_deviations(np.array([0.25, 0.0, 0.0]), config) ** 2)
    np.testing.assert_allclose(in_steps, once)


def test_slip_stretches_the_way_and_the_turn() -> None:
    straight, bend = step_of(np.array([1.0, 0.0, 0.0])), step_of(np.array([0.1, 0.0, 0.1]))
    moved = move(np.zeros((1, 3)), np.array([[-0.2, 0.5, 9.0]]), straight, np.random.default_rng(0))
    np.testing.assert_allclose(moved[0], [0.8, 0.0, 0.0], atol=1e-9)
    moved = move(np.zeros((1, 3)), np.array([[0.0, 0.5, 9.0]]), bend, np.random.default_rng(0))
    np.testing.assert_allclose(moved[0, 2], 0.15, atol=1e-9)


def test_each_particle_is_behind_by_its_own_share() -> None:
    step = step_of(np.array([0.1, 0.0, 0.06]), behind=np.array([-0.04, 0.0, -0.06]))
    lags = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.5], [0.0, 0.0, 1.0]])
    moved = move(np.zeros((3, 3)), lags, step, np.random.default_rng(0))
    np.testing.assert_allclose(np.hypot(moved[:, 0], moved[:, 1]), [0.1, 0.08, 0.06], atol=1e-4)
    np.testing.assert_allclose(moved[:, 2], [0.06, 0.03, 0.0], atol=1e-9)


def test_headings_stay_within_half_a_turn() -> None:
    start, step = np.array([[0.0, 0.0, 3.0]]), np.array([0.0, 0.0, 1.0])
    moved = move(start, NO_SLIP, step_of(step), np.random.default_rng(0))
    np.testing.assert_allclose(between(moved[0], compose([0.0, 0.0, 3.0], step)), 0.0, atol=1e-12)
    assert -np.pi < moved[0, 2] <= np.pi


def test_a_carried_covariance_is_that_of_carried_particles() -> None:
    rng = np.random.default_rng(0)
    pose, step = np.array([3.0, -2.0, 0.8]), np.array([1.0, 0.3, 0.4])
    covariance = np.array([[0.010, 0.004, 0.002], [0.004, 0.020, -0.003], [0.002, -0.003, 0.005]])
    deviations = np.array([0.10, 0.03, 0.05])
    cloud = rng.multivariate_normal(pose, covariance, 200_000)
    moved = move(cloud, np.zeros((200_000, 3)), step_of(step, deviations), rng)
    carried, grown = carry(pose, covariance, step, deviations)
    np.testing.assert_allclose(carried, compose(pose, step), atol=1e-12)
    np.testing.assert_allclose(grown, np.cov(moved.T), atol=5e-4)
