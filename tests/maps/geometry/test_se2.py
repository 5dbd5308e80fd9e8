"""Poses follow the algebra of homogeneous matrices, one at a time and many at once."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from racecar.maps.geometry.se2 import IDENTITY, Pose, adjoint, between, chained, compose, inverse, wrap_angle
from racecar.maps.geometry.se2_kernels import composed, inverse_of_symmetric, step_between, wrapped

numbers = st.floats(-50.0, 50.0)
poses = st.tuples(numbers, numbers, numbers).map(np.array)
many_poses = st.lists(poses, min_size=1, max_size=5).map(np.array)


def matrix(pose: Pose) -> np.ndarray:
    x, y, yaw = pose
    return np.array([[np.cos(yaw), -np.sin(yaw), x], [np.sin(yaw), np.cos(yaw), y], [0.0, 0.0, 1.0]])


@given(poses, poses)
def test_composing_is_the_product_of_matrices(first: Pose, second: Pose) -> None:
    composed = compose(first, second)
    np.testing.assert_allclose(matrix(composed), matrix(first) @ matrix(second), atol=1e-11)
    assert -np.pi < composed[2] <= np.pi


@given(poses, poses)
def test_between_is_undone_by_composing(first: Pose, second: Pose) -> None:
    np.testing.assert_allclose(matrix(compose(first, between(first, second))), matrix(second), atol=1e-11)
    np.testing.assert_allclose(matrix(compose(inverse(first), first)), matrix(IDENTITY), atol=1e-11)


@given(many_poses)
def test_chained_steps_follow_one_another(steps: Pose) -> None:
    chain = chained(steps)
    np.testing.assert_array_equal(chain[0], IDENTITY)
    for before, after, step in zip(chain, chain[1:], steps, strict=False):
        np.testing.assert_allclose(matrix(after), matrix(compose(before, step)), atol=1e-11)


@given(poses, many_poses)
def test_many_at_once_are_what_each_is(one: Pose, many: Pose) -> None:
    np.testing.assert_allclose(compose(one, many), [compose(one, each) for each in many], atol=1e-12)
    np.testing.assert_allclose(compose(many, one), [compose(each, one) for each in many], atol=1e-12)
    np.testing.assert_allclose(between(many, many[::-1]), list(map(between, many, many[::-1])), atol=1e-12)
    np.testing.assert_allclose(inverse(many), [inverse(each) for each in many], atol=1e-12)


@given(poses, st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(np.array))
def test_adjoint_carries_small_motions_from_one_frame_to_the_other(a_from_b: Pose, twist: Pose) -> None:
    small = 1e-6 * twist
    moved_in_a = compose(compose(a_from_b, small), inverse(a_from_b))
    np.testing.assert_allclose(adjoint(a_from_b) @ small, moved_in_a, atol=1e-9)


@given(poses, many_poses)
def test_adjoints_multiply_as_their_poses_do(one: Pose, many: Pose) -> None:
    np.testing.assert_allclose(adjoint(compose(one, many)), adjoint(one) @ adjoint(many), atol=1e-9)
    np.testing.assert_array_equal(adjoint(many), [adjoint(each) for each in many])


number = st.floats(-100.0, 100.0)
pose = st.tuples(number, number, number).map(np.array)


def assert_same(one: np.ndarray, other: np.ndarray) -> None:
    np.testing.assert_allclose(one[:2], other[:2], atol=1e-10)
    assert abs(wrap_angle(one[2] - other[2])) < 1e-10


@given(pose, pose)
def test_poses_are_composed_as_outside_of_loops(a_from_b: np.ndarray, b_from_c: np.ndarray) -> None:
    assert_same(composed(a_from_b, b_from_c), compose(a_from_b, b_from_c))


@given(pose, pose)
def test_a_step_is_the_second_pose_seen_from_the_first(a: np.ndarray, b: np.ndarray) -> None:
    assert_same(step_between(a, b), between(a, b))


@given(number)
def test_wrapped_angles_are_within_half_a_turn(angle: float) -> None:
    assert -np.pi <= wrapped(angle) < np.pi + 1e-12
    assert abs(wrap_angle(wrapped(angle) - angle)) < 1e-12


@given(st.lists(st.floats(-3.0, 3.0), min_size=9, max_size=9), st.floats(0.05, 10.0))
def test_a_matrix_times_its_inverse_is_one(numbers: list[float], least: float) -> None:
    root = np.reshape(numbers, (3, 3))
    matrix = root @ root.T + least * np.eye(3)
    inverse = inverse_of_symmetric(matrix)
    np.testing.assert_allclose(matrix @ inverse, np.eye(3), atol=1e-9)
    np.testing.assert_array_equal(inverse, inverse.T)


def test_only_the_upper_triangle_is_read() -> None:
    matrix = np.array([[2.0, 0.3, 0.1], [0.3, 1.5, -0.2], [0.1, -0.2, 1.0]])
    np.testing.assert_array_equal(inverse_of_symmetric(np.triu(matrix)), inverse_of_symmetric(matrix))
