"""Where odometry goes on, and where it has begun anew."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecar.maps.geometry.se2 import IDENTITY, compose
from racecar.maps.sensing.odometry import Odometry, OdometryBuffer, is_jump

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


def test_a_buffer_tells_a_jump_from_samples_that_come_late() -> None:
    buffer, away = OdometryBuffer(), np.array([5.0, 0.0, 0.0])
    assert not buffer.jumps_to(Odometry(0, away, IDENTITY))
    buffer.add(Odometry(20_000_000, IDENTITY, IDENTITY))
    assert buffer.jumps_to(Odometry(40_000_000, away, IDENTITY))
    assert not buffer.jumps_to(Odometry(10_000_000, away, IDENTITY))
    assert not buffer.jumps_to(Odometry(20_000_000, away, IDENTITY))


MILLISECOND = 1_000_000


def steady_drive(lag: int) -> OdometryBuffer:
    """One metre a second, told 50 times a second up to 0.38 s."""
    buffer = OdometryBuffer(lag=lag * MILLISECOND)
    for k in range(20):
        buffer.add(Odometry(k * 20 * MILLISECOND, np.array([0.02 * k, 0.0, 0.0]), IDENTITY))
    return buffer


def test_late_samples_tell_of_earlier_times_and_are_carried_on_for_as_long() -> None:
    stamps = np.array([100, 330, 380, 10_000]) * MILLISECOND
    assert steady_drive(50).pose_at(stamps)[:, 0] == pytest.approx([0.15, 0.38, 0.43, 0.43])


def test_early_samples_tell_of_later_times() -> None:
    stamps = np.array([100, 400, 10_000]) * MILLISECOND
    assert steady_drive(-50).pose_at(stamps)[:, 0] == pytest.approx([0.05, 0.35, 0.38])


@pytest.mark.parametrize(
    ("at", "lag", "is_told"),
    [
        (-50, 0, True),
        (-150, 0, False),
        (200, 0, True),
        (380 + 90, 0, True),
        (380 + 500, 0, False),
        (380 + 500, 90, False),
        (1380 - 90, 0, True),
        (1380 - 190, 100, True),
        (1400 + 500, 0, True),
        (3000, 0, False),
    ],
)
def test_near_its_samples_a_buffer_tells_where_the_car_was(at: int, lag: int, is_told: bool) -> None:
    """Odometry paused for more than a second, and for less."""
    buffer = steady_drive(lag)
    for late in (1390, 2350):
        buffer.add(Odometry(late * MILLISECOND, np.array([1.0, 0.0, 0.0]), IDENTITY))
    assert buffer.tells_of(at * MILLISECOND) == is_told


def test_an_empty_buffer_tells_nothing() -> None:
    assert not OdometryBuffer().tells_of(0)
