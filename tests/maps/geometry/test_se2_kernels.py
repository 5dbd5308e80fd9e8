import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from racecar.maps.geometry.se2 import between, compose, wrap_angle
from racecar.maps.geometry.se2_kernels import composed, step_between, wrapped

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
