import numpy as np
import pytest

from racecar.localization.odometry.slip import changed_slips
from racecar.localization.odometry.speed_memory import tyre_effort

MOST = np.full(2, 0.3)


def test_tyres_are_pushed_by_braking_and_by_fast_bends() -> None:
    steady = tyre_effort(np.array([3.0, 0.0, 0.0]), np.array([3.0, 0.0, 0.0]), 0.1)
    np.testing.assert_allclose(steady, 0.0)
    braking = tyre_effort(np.array([3.0, 0.0, 0.0]), np.array([2.8, 0.0, 0.0]), 0.1)
    np.testing.assert_allclose(braking, [0.5, 0.0])
    bend = tyre_effort(np.array([4.0, 0.0, 2.0]), np.array([4.0, 0.0, 2.0]), 0.1)
    np.testing.assert_allclose(bend, [0.0, 1.0])


@pytest.mark.parametrize(("effort", "expected"), [(0.0, 0.05), (1.0, 0.3)])
def test_in_the_long_run_slips_are_as_large_as_the_effort_says(effort: float, expected: float) -> None:
    rng, slips = np.random.default_rng(0), np.zeros((5000, 3))
    for _ in range(300):
        slips = changed_slips(slips, 0.2, np.full(2, effort), MOST, rng)
    np.testing.assert_allclose(slips.std(axis=0), [expected, expected, 0.7], rtol=0.06)


def test_slips_keep_while_the_tyres_grip_and_change_soon_when_they_are_pushed() -> None:
    rng, slips = np.random.default_rng(0), np.random.default_rng(1).normal(0.0, 0.05, (2000, 3))
    kept = changed_slips(slips, 0.5, np.zeros(2), MOST, rng)
    assert np.corrcoef(kept[:, 0], slips[:, 0])[0, 1] > 0.9
    pushed = changed_slips(slips, 2.0, np.ones(2), MOST, rng)
    assert abs(np.corrcoef(pushed[:, 0], slips[:, 0])[0, 1]) < 0.1


def test_the_lag_is_a_cars_own_however_the_tyres_are_pushed() -> None:
    rng, slips = np.random.default_rng(0), np.random.default_rng(1).normal(0.0, 0.7, (2000, 3))
    pushed = changed_slips(slips, 2.0, np.ones(2), MOST, rng)
    assert np.corrcoef(pushed[:, 2], slips[:, 2])[0, 1] > 0.9


def test_after_an_infinite_time_slips_are_those_of_a_car_that_nothing_is_known_of() -> None:
    slips = changed_slips(np.full((5000, 3), 9.0), np.inf, np.zeros(2), MOST, np.random.default_rng(0))
    np.testing.assert_allclose(slips.mean(axis=0), 0.0, atol=0.03)
    np.testing.assert_allclose(slips.std(axis=0), [0.05, 0.05, 0.7], rtol=0.05)


def test_a_car_that_cannot_slip_does_not() -> None:
    slips = changed_slips(np.zeros((10, 3)), 1.0, np.ones(2), np.zeros(2), np.random.default_rng(0))
    assert np.all(slips == 0.0)
