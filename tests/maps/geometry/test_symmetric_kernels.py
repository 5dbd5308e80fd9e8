import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from racecar.maps.geometry.se2_kernels import inverse_of_symmetric


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
