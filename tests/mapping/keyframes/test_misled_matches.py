"""What wheels and scans contradict each other in is blamed on the side that it speaks against."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from racecar.mapping.keyframes.config import MisledConfig
from racecar.mapping.keyframes.misled_matches import are_misled

STEPS = 1000
TURNS = np.full(STEPS, 0.01)


def drive(seed: int, wheels_err: float = 0.002) -> tuple[np.ndarray, np.ndarray]:
    """How far wheels are off the matches in each step (S, 3), and the residuals (S,)."""
    generator = np.random.default_rng(seed)
    off = generator.normal(0.0, [0.01, 0.005, wheels_err], (STEPS, 3))
    return off, generator.normal(0.013, 0.001, STEPS)


@given(st.integers(0, 1000), st.integers(100, 800))
def test_matches_that_fit_badly_are_blamed(seed: int, begin: int) -> None:
    off, residuals = drive(seed)
    there = slice(begin, begin + 60)
    off[there, 2] += 0.01
    residuals[there] += 0.006
    misled = are_misled(off, TURNS, residuals, MisledConfig())
    assert misled[there].mean() > 0.9
    assert misled.sum() < 60 + 2 * MisledConfig().window


@given(st.integers(0, 1000), st.integers(100, 800))
def test_wheels_that_slip_are_to_blame_themselves(seed: int, begin: int) -> None:
    off, residuals = drive(seed)
    off[begin : begin + 60, 2] += 0.01
    assert not are_misled(off, TURNS, residuals, MisledConfig()).any()


@given(st.integers(0, 1000))
def test_wheels_that_know_no_turns_are_to_blame_although_scans_fit_badly_there(seed: int) -> None:
    off, residuals = drive(seed)
    turns = np.zeros(STEPS)
    for begin in range(50, 950, 100):
        turns[begin : begin + 15] = 0.1
        off[begin : begin + 15, 2] += 0.1
        residuals[begin : begin + 15] += 0.004 * (begin % 200 > 100)
    assert not are_misled(off, turns, residuals, MisledConfig()).any()


@given(st.integers(0, 1000))
def test_a_bad_fit_alone_is_no_fault(seed: int) -> None:
    off, residuals = drive(seed)
    residuals[300:400] += 0.006
    assert not are_misled(off, TURNS, residuals, MisledConfig()).any()


def test_nothing_is_known_without_wheels_or_matches() -> None:
    off, residuals = drive(0)
    assert not are_misled(
        np.full_like(off, np.nan), TURNS, np.full_like(residuals, np.nan), MisledConfig()
    ).any()
    assert not are_misled(off[:50], TURNS[:50], residuals[:50], MisledConfig()).any()
