"""What matches and guesses are worth, in each other's units."""

import numpy as np
import pytest

from racecar.sensors.matching.match_information import as_prior, match_information

HESSIAN = np.diag([30.0, 20.0, 400.0])


@pytest.mark.parametrize("residual", [0.0, 0.005, 0.02, 0.03])
def test_a_prior_as_good_as_a_match_weighs_as_much(residual: float) -> None:
    """But for what keeps information from being singular."""
    prior = as_prior(match_information(HESSIAN, residual), residual)
    np.testing.assert_allclose(prior, HESSIAN, atol=1e-4)


def test_a_poor_match_tells_less() -> None:
    clean, noisy = match_information(HESSIAN, 0.0), match_information(HESSIAN, 0.02)
    np.testing.assert_allclose(noisy[0, 0], clean[0, 0] / 4.0, rtol=1e-2)
