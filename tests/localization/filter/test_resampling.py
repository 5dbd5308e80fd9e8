import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from racecar.localization.filter.particle_filter import systematic_resample

unnormalized = arrays(np.float64, st.integers(1, 60), elements=st.floats(0.0, 1.0)).filter(
    lambda weights: weights.sum() > 1e-6
)


@given(unnormalized, st.integers(1, 200), st.integers(0, 2**32))
def test_each_particle_is_taken_as_often_as_its_weight_says(
    weights: NDArray[np.float64], count: int, seed: int
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
