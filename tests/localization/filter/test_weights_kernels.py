import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from racecar.localization.filter.weights_kernels import take_evidence


@given(
    arrays(np.float64, 12, elements=st.floats(-30.0, 0.0)),
    arrays(np.float64, 12, elements=st.floats(-1e6, 0.0)),
    st.floats(0.1, 10.0),
)
def test_weights_are_those_of_bayes_rule(
    log_weights: np.ndarray, log_likelihood: np.ndarray, most: float
) -> None:
    exact = log_weights + np.maximum(log_likelihood, log_likelihood.max() - most)
    exact -= exact.max()
    weights, effective_size = take_evidence(log_weights, log_likelihood, most)
    np.testing.assert_allclose(log_weights, exact, atol=1e-9)
    expected = np.exp(exact) / np.exp(exact).sum()
    np.testing.assert_allclose(weights, expected, rtol=1e-7)
    np.testing.assert_allclose(effective_size, 1.0 / (expected @ expected), rtol=1e-7)


def test_what_weighs_nothing_vanishes_without_underflow() -> None:
    weights, effective_size = take_evidence(np.array([-5000.0, 0.0, 0.0]), np.zeros(3), 1.0)
    assert 0.0 <= weights[0] < 1e-20
    assert np.isclose(effective_size, 2.0)
