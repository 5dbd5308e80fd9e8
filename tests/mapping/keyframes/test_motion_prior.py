"""A motion is likely near a guess, the more the more the guess is trusted, and possible anywhere."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from racecar.mapping.keyframes.motion_prior import guess_shares, log_likelihood
from racecar.maps.geometry.se2 import Pose, compose

SIGMA = 0.05
GUESSES = np.array([[1.0, 0.0, 0.2], [-1.0, 0.5, 0.0]])
SHARES = np.array([0.9, 0.09])
REACH, VOLUME = 1.5, 18.0 * np.pi
"""Metres to each side, and that over all headings."""

offs = st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(np.array)


def likelihood(poses: list[Pose], guesses: Pose = GUESSES, shares: np.ndarray = SHARES) -> np.ndarray:
    return log_likelihood(np.array(poses), guesses, shares, np.eye(3) / SIGMA**2, REACH)


def test_the_first_guess_is_trusted_unless_it_is_doubted() -> None:
    trusted = guess_shares(3, is_first_doubted=False, is_left_alone=False)
    assert trusted[0] > 0.95
    assert trusted[1] == trusted[2] < 0.01
    doubted = guess_shares(3, is_first_doubted=True, is_left_alone=False)
    assert doubted[0] == doubted[1] == doubted[2]


def test_where_the_car_may_have_been_carried_all_guesses_may_be_wrong() -> None:
    driven, carried = (
        guess_shares(2, is_first_doubted=False, is_left_alone=is_left_alone).sum()
        for is_left_alone in (False, True)
    )
    assert carried < 0.8 < 0.99 < driven < 1.0


def test_where_the_first_guess_leads_is_as_likely_as_it_is_trusted() -> None:
    first, other = likelihood(list(GUESSES))
    assert np.isclose(first, 0.0, atol=1e-3)
    assert np.isclose(other, np.log(0.1), atol=0.05)


@given(offs, st.floats(0.0, 1.0))
def test_nearer_to_the_guesses_is_likelier(off: np.ndarray, share: float) -> None:
    poses = compose(GUESSES[0], np.array([share * off, off]))
    near, far = likelihood(list(poses), GUESSES[:1], np.array([0.99]))
    assert near >= far - 1e-9


@given(offs)
def test_no_place_is_impossible(off: np.ndarray) -> None:
    (anywhere,) = likelihood([100.0 * off + [500.0, 0.0, 0.0]])
    uniform = 0.01 / VOLUME
    peak = 0.9 * 2.0 / (np.sqrt(np.pi) / 2.0 * (3.0 * np.pi) ** 1.5) / SIGMA**3
    assert np.isclose(anywhere, np.log(uniform / peak), atol=0.01)


def test_a_guess_that_misses_by_ten_standard_deviations_is_likelier_than_chance() -> None:
    """Wheels that slip err so; a Gaussian would call it impossible."""
    missed, anywhere = likelihood(
        [compose(GUESSES[0], [10 * SIGMA, 0.0, 0.0]), compose(GUESSES[0], [50.0, 0.0, 0.0])]
    )
    assert missed > anywhere + 3.0
