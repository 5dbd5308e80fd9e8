import numpy as np
import pytest

from racecar.localization.verdict.pose_steps import PoseSteps
from tests.localization.verdict.estimates import estimate


def metres(places: list[float], starts: frozenset[int] = frozenset()) -> float:
    steps = PoseSteps(0.1)
    return sum(steps.follow(estimate(0.1 * k, x, is_start=k in starts))[0] for k, x in enumerate(places))


def test_a_path_is_as_long_as_it_is() -> None:
    assert metres(np.linspace(0.0, 5.0, 701).tolist()) == pytest.approx(5.0, abs=0.1)


def test_jitter_of_a_car_that_stands_adds_nothing() -> None:
    assert metres(np.random.default_rng(0).normal(0.0, 0.02, 500).tolist()) == 0.0


def test_jumps_are_no_way() -> None:
    places = np.concatenate([np.linspace(0.0, 1.0, 21), np.linspace(30.0, 31.0, 21)])
    assert metres(places.tolist(), frozenset([0, 21])) == pytest.approx(2.0, abs=0.2)


def test_turns_on_the_spot_are_steps_where_they_are_wanted() -> None:
    steps = PoseSteps(0.1, 0.5)
    assert steps.follow(estimate(0.0, 0.0, yaw=3.0)) == (0.0, 0.0)
    assert steps.follow(estimate(0.1, 0.0, yaw=-3.1)) == (0.0, 0.0)
    assert steps.follow(estimate(0.2, 0.0, yaw=-2.7)) == pytest.approx((0.0, 2 * np.pi - 5.7))
