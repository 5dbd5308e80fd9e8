import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from localization.motion_model import drift_noise, move, odometry_noise
from maps.se2 import IDENTITY, between, compose, wrap_angle

coordinate = st.floats(-5.0, 5.0)
poses = st.tuples(coordinate, coordinate, st.floats(-3.1, 3.1)).map(np.array)


@settings(deadline=None)
@given(poses, poses)
def test_without_noise_every_particle_moves_by_the_increment(start: np.ndarray, step: np.ndarray) -> None:
    moved = move(np.tile(start, (3, 1)), step, np.zeros(3), np.random.default_rng(0))
    expected = compose(start, step)
    np.testing.assert_allclose(moved[:, :2], np.tile(expected[:2], (3, 1)), atol=1e-9)
    np.testing.assert_allclose(wrap_angle(moved[:, 2] - expected[2]), 0.0, atol=1e-9)


def test_noise_lies_in_the_base_frame() -> None:
    start = np.tile([1.0, 2.0, np.pi / 2], (20_000, 1))
    moved = move(start, np.array([1.0, 0.0, 0.0]), np.array([0.2, 0.01, 0.03]), np.random.default_rng(0))
    np.testing.assert_allclose(moved.mean(axis=0), [1.0, 3.0, np.pi / 2], atol=0.01)
    np.testing.assert_allclose(moved.std(axis=0), [0.01, 0.2, 0.03], rtol=0.03)


def test_a_car_that_stands_still_gains_no_noise() -> None:
    assert np.all(odometry_noise(IDENTITY, 0.02, 0.3) == 0.0)
    cloud = np.random.default_rng(0).normal(size=(50, 3))
    assert move(cloud, IDENTITY, np.zeros(3), np.random.default_rng(1)) is cloud


def test_noise_does_not_depend_on_the_number_of_steps() -> None:
    once = odometry_noise(np.array([4.0, 0.0, 0.0]), 0.02, 0.0)
    np.testing.assert_allclose(once, 0.04)
    in_steps = np.sqrt(16 * odometry_noise(np.array([0.25, 0.0, 0.0]), 0.02, 0.0) ** 2)
    np.testing.assert_allclose(in_steps, once)
    np.testing.assert_allclose(drift_noise(4.0, 0.2), 0.4)


def test_slip_is_a_share_of_each_coordinate() -> None:
    np.testing.assert_allclose(
        odometry_noise(np.array([1.0, 0.0, -0.5]), 1e-12, 0.3), [0.3, 0.0, 0.15], atol=1e-9
    )


def test_headings_stay_within_half_a_turn() -> None:
    moved = move(
        np.array([[0.0, 0.0, 3.0]]), np.array([0.0, 0.0, 1.0]), np.zeros(3), np.random.default_rng(0)
    )
    np.testing.assert_allclose(between(moved[0], compose([0.0, 0.0, 3.0], [0.0, 0.0, 1.0])), 0.0, atol=1e-12)
    assert -np.pi < moved[0, 2] <= np.pi
