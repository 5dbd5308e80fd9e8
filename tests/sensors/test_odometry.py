"""Where odometry goes on, and where it has begun anew."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecar.maps.geometry.se2 import IDENTITY, compose
from racecar.sensors.odometry import is_jump

poses = st.tuples(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(-np.pi, np.pi)).map(np.array)
speeds = st.tuples(st.floats(-14.0, 14.0), st.floats(-3.0, 3.0), st.floats(-15.0, 15.0)).map(np.array)


@given(poses, speeds, st.floats(0.0, 3.0))
def test_no_car_jumps_however_it_drives(before: np.ndarray, speed: np.ndarray, seconds: float) -> None:
    assert not is_jump(before, compose(before, speed * seconds), seconds)


@given(poses, speeds, st.sampled_from([0.01, 0.02, 0.04]))
def test_messages_that_are_stamped_as_they_come_are_no_jump(
    before: np.ndarray, speed: np.ndarray, period: float
) -> None:
    """In a bunch, a tenth of a millisecond apart."""
    assert not is_jump(before, compose(before, 0.8 * speed * period), 1e-4)


@given(poses, st.floats(-np.pi, np.pi), st.floats(1.5, 100.0))
def test_another_origin_is_a_jump(before: np.ndarray, direction: float, metres: float) -> None:
    away = np.array([metres * np.cos(direction), metres * np.sin(direction), 0.0])
    assert is_jump(before, before + away, 0.02)


@pytest.mark.parametrize("turn", [1.0, -2.0, np.pi, 2.0 * np.pi - 1.0])
def test_a_turn_on_the_spot_within_no_time_is_a_jump(turn: float) -> None:
    assert is_jump(IDENTITY, np.array([0.0, 0.0, turn]), 0.02)
