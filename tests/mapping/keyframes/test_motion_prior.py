"""A motion is likely near a guess, the more the more the guess is trusted, and possible anywhere."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from racecar.mapping.keyframes.motion_prior import MotionPrior
from racecar.maps.geometry.se2 import Pose, compose

SIGMA = 0.05
GUESSES = np.array([[1.0, 0.0, 0.2], [-1.0, 0.5, 0.0]])
PRIOR = MotionPrior(GUESSES, np.array([0.9, 0.09]), np.eye(3) / SIGMA**2, 50.0)

offs = st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(np.array)


def log_likelihood(*poses: Pose) -> np.ndarray:
    return PRIOR.log_likelihood(np.array(poses))


def test_where_the_first_guess_leads_is_as_likely_as_it_is_trusted() -> None:
    first, other = log_likelihood(*GUESSES)
    assert np.isclose(first, 0.0, atol=1e-3)
    assert np.isclose(other, np.log(0.1), atol=0.05)


@given(offs, st.floats(0.0, 1.0))
def test_nearer_to_the_guesses_is_likelier(off: np.ndarray, share: float) -> None:
    lone = MotionPrior(GUESSES[:1], np.array([0.99]), np.eye(3) / SIGMA**2, 50.0)
    near, far = lone.log_likelihood(compose(GUESSES[0], np.array([share * off, off])))
    assert near >= far - 1e-9


@given(offs)
def test_no_place_is_impossible(off: np.ndarray) -> None:
    (anywhere,) = log_likelihood(100.0 * off + [500.0, 0.0, 0.0])
    uniform = 0.01 / 50.0
    peak = 0.9 * 2.0 / (np.sqrt(np.pi) / 2.0 * (3.0 * np.pi) ** 1.5) / SIGMA**3
    assert np.isclose(anywhere, np.log(uniform / peak), atol=0.01)


def test_a_guess_that_misses_by_ten_standard_deviations_is_likelier_than_chance() -> None:
    """Wheels that slip err so; a Gaussian would call it impossible."""
    missed, anywhere = log_likelihood(
        compose(GUESSES[0], [10 * SIGMA, 0.0, 0.0]), compose(GUESSES[0], [50.0, 0.0, 0.0])
    )
    assert missed > anywhere + 3.0
