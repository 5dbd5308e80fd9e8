"""Moving particles; the sums over them are tested with the clusters."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from racecar.localization.filter.particle_kernels import move_particles
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose, wrap_angle

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


def test_headings_stay_within_half_a_turn() -> None:
    start, step = np.array([[0.0, 0.0, 3.0]]), np.array([0.0, 0.0, 1.0])
    moved = move(start, np.zeros((1, 3)), step)
    np.testing.assert_allclose(between(moved[0], compose([0.0, 0.0, 3.0], step)), 0.0, atol=1e-12)
    assert -np.pi < moved[0, 2] <= np.pi


def test_a_car_that_stands_still_leaves_them_where_they_are() -> None:
    cloud = np.random.default_rng(0).uniform(-1.0, 1.0, size=(50, 3))
    np.testing.assert_allclose(move(cloud, np.ones((50, 3)), IDENTITY), cloud, atol=1e-12)
