import numpy as np
import pytest

from racecar.localization.config import LocalizationConfig
from racecar.localization.odometry.motion_model import carry, drift_deviations, odometry_deviations
from racecar.localization.odometry.slip import changed_slips
from racecar.localization.odometry.speed_memory import tyre_effort
from racecar.maps.geometry.se2 import IDENTITY, compose

CONFIG = LocalizationConfig()


def exact(**alphas: float) -> LocalizationConfig:
    """No noise but what is named."""
    tiny = 1e-9
    names = ("turn_noise_per_turn", "turn_noise_per_metre", "path_noise_per_metre", "path_noise_per_turn")
    return LocalizationConfig(**{**dict.fromkeys(names, tiny), **alphas})


def test_a_car_that_stands_still_gains_no_noise() -> None:
    assert np.all(odometry_deviations(IDENTITY, CONFIG) == 0.0)


def test_motion_that_nothing_measured_goes_any_way() -> None:
    np.testing.assert_allclose(drift_deviations(4.0, CONFIG), 0.4)


def test_each_alpha_says_what_it_stands_for() -> None:
    metre, radian = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, -1.0])
    for name, step, expected in (
        ("turn_noise_per_turn", radian, [0.0, 0.0, 0.3]),
        ("turn_noise_per_metre", metre, [0.0, 0.0, 0.3]),
        ("path_noise_per_metre", metre, [0.3, 0.3, 0.0]),
        ("path_noise_per_turn", radian, [0.3, 0.3, 0.0]),
    ):
        np.testing.assert_allclose(odometry_deviations(step, exact(**{name: 0.3})), expected, atol=1e-8)


def test_noise_does_not_depend_on_the_number_of_steps() -> None:
    config = exact(path_noise_per_metre=0.02, turn_noise_per_metre=0.02)
    once = odometry_deviations(np.array([4.0, 0.0, 0.0]), config)
    np.testing.assert_allclose(once[[0, 2]], 0.04)
    in_steps = np.sqrt(16 * odometry_deviations(np.array([0.25, 0.0, 0.0]), config) ** 2)
    np.testing.assert_allclose(in_steps, once)


def test_a_carried_covariance_is_that_of_carried_poses() -> None:
    rng = np.random.default_rng(0)
    pose, step = np.array([3.0, -2.0, 0.8]), np.array([1.0, 0.3, 0.4])
    covariance = np.array([[0.010, 0.004, 0.002], [0.004, 0.020, -0.003], [0.002, -0.003, 0.005]])
    deviations = np.array([0.10, 0.03, 0.05])
    cloud = rng.multivariate_normal(pose, covariance, 200_000)
    moved = compose(cloud, step + deviations * rng.standard_normal(cloud.shape))
    carried, grown = carry(pose, covariance, step, deviations)
    np.testing.assert_allclose(carried, compose(pose, step), atol=1e-12)
    np.testing.assert_allclose(grown, np.cov(moved.T), atol=5e-4)


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
