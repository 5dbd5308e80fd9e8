"""What the simulated car's steering does."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecar.pipelines.simulation.car import MAX_STEERING, Car, steering_for

speeds = st.floats(0.1, 5.0) | st.floats(-5.0, -0.1)


@given(speeds, st.floats(-0.39, 0.39))
def test_the_steering_for_a_turn_is_the_one_that_makes_it(speed: float, steering: float) -> None:
    turning_speed = Car(0.0, 0.0, 0.0, speed, steering).turning_speed
    assert steering_for(speed, turning_speed) == pytest.approx(steering, abs=1e-9)


@pytest.mark.parametrize(("turn", "steering"), [(2.0, MAX_STEERING), (-2.0, -MAX_STEERING), (0.0, 0.0)])
def test_a_car_that_stands_cannot_turn_but_steers(turn: float, steering: float) -> None:
    assert steering_for(0.0, turn) == steering
    assert not math.isnan(steering_for(1e-300, 1e300))
