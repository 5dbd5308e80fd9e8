import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import chi2

from racecar.localization.filter.adaptive_count_kernels import count_occupied
from racecar.localization.filter.adaptive_count_kernels import needed_particles as needed_by_config
from racecar.localization.filter.config import AdaptiveCountConfig

BIN = np.array([0.1, 0.1, np.radians(5.0)])


def apart(places: int, copies: int = 1) -> np.ndarray:
    """(places * copies, 3) poses in as many bins."""
    return np.repeat(
        np.column_stack([0.1 * np.arange(places) + 0.05, *np.zeros((2, places))]), copies, axis=0
    )


def needed_particles(poses: np.ndarray, weights: np.ndarray, fewest: int, most: int) -> int:
    return needed_by_config(poses, weights, fewest, most, AdaptiveCountConfig())


def even(count: int) -> np.ndarray:
    return np.full(count, 1.0 / count)


@pytest.mark.parametrize("places", [2, 5, 20, 100, 500])
def test_the_count_keeps_the_divergence_below_its_bound(places: int) -> None:
    """KLD-sampling: n = chi² of k - 1 degrees of freedom at 99 %, over twice the bound of 0.02."""
    told = needed_particles(apart(places), even(places), 1, 10**6)
    assert told == pytest.approx(chi2.ppf(0.99, places - 1) / (2 * 0.02), rel=0.03)


def test_it_does_not_matter_how_many_particles_share_a_place() -> None:
    assert needed_particles(apart(30), even(30), 1, 10**6) == needed_particles(
        apart(30, 50), even(1500), 1, 10**6
    )


def test_a_cloud_at_one_place_gets_the_fewest() -> None:
    assert needed_particles(apart(1, 100), even(100), 70, 10**6) == 70


@given(st.integers(1, 200), st.integers(1, 500), st.integers(0, 5000))
def test_the_count_stays_between_the_fewest_and_the_most(places: int, fewest: int, more: int) -> None:
    told = needed_particles(apart(places), even(places), fewest, fewest + more)
    assert fewest <= told <= fewest + more
    assert told <= needed_particles(apart(places + 1), even(places + 1), fewest, fewest + more)


def test_particles_of_no_weight_cover_nothing() -> None:
    poses = apart(60)
    weights = np.concatenate([even(10), np.full(50, 1e-9)])
    weights /= weights.sum()
    assert needed_particles(poses, weights, 1, 10**6) == needed_particles(apart(10), even(10), 1, 10**6)


@settings(max_examples=60)
@given(st.integers(1, 3000), st.floats(0.01, 50.0), st.integers(0, 2**32 - 1))
def test_the_bins_counted_are_those_that_differ(count: int, spread: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    poses = rng.normal(0.0, [spread, spread, 1.0], (count, 3))
    weights = rng.random(count)
    heavy = np.floor(poses / BIN)[weights >= 0.3]
    assert count_occupied(poses, weights, BIN, 0.3) == len(np.unique(heavy, axis=0))
