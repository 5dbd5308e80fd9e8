"""The lag of odometry is learned from turns, and none is made up."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.sensors.motion.lag import OdometryLag
from racecar.sensors.motion.odometry_buffer import OdometryBuffer
from racecar.sensors.odometry import Odometry

SECOND = 1_000_000_000


def heading(seconds: float) -> float:
    return float(np.sin(1.7 * seconds) + 0.5 * np.sin(0.6 * seconds))


def drive(
    seconds: float, late: float, wheel_scale: float = 1.0, wheel_noise: float = 0.0, wheels_every: int = 1
) -> OdometryLag:
    """Scans ten times a second, and wheels, up to fifty times a second, stamped ``late`` seconds late."""
    rng, lag, wheels = np.random.default_rng(0), OdometryLag(), OdometryBuffer()
    by_wheels = heading(-late)
    for tick in range(int(50 * seconds)):
        now = tick / 50
        by_wheels += (
            wheel_scale * (heading(now - late) - heading(now - 0.02 - late)) + wheel_noise * rng.normal()
        )
        if tick % wheels_every == 0:
            wheels.add(Odometry(round(now * SECOND), np.array([0.0, 0.0, by_wheels]), np.zeros(3)))
        if tick % 5 == 0:
            turn = heading(now) - heading(now - 0.1) + 0.002 * rng.normal()
            lag.add_turn(round(now * SECOND), turn)
    lag.learn(wheels)
    return lag


@settings(max_examples=20)
@given(st.floats(0.1, 0.25), st.sampled_from([-1.0, 1.0]), st.floats(0.9, 1.1))
def test_the_lag_is_learned_from_turns(size: float, sign: float, wheel_scale: float) -> None:
    assert abs(drive(40.0, sign * size, wheel_scale).nanoseconds * 1e-9 - sign * size) < 0.025


@pytest.mark.parametrize(
    ("seconds", "late", "noise"),
    [(40.0, 0.2, 0.3), (40.0, 0.0, 0.002), (0.6, 0.2, 0.0)],
    ids=["noisy wheels", "wheels that agree", "hardly a turn"],
)
def test_no_lag_is_made_up(seconds: float, late: float, noise: float) -> None:
    assert drive(seconds, late, wheel_noise=noise).nanoseconds == 0


def test_samples_far_apart_show_no_short_lag() -> None:
    assert drive(40.0, 0.1, wheels_every=10).nanoseconds == 0
    assert drive(40.0, 0.1, wheels_every=2).nanoseconds != 0


def learned_from(turns: list[tuple[float, float]], wheels_turn: bool = True) -> OdometryLag:
    """Each turn is so many seconds after the last one, to the one side and back, and late by so much by the
    wheels' clock."""
    lag, wheels, now = OdometryLag(), OdometryBuffer(), 0.0
    times = np.arange(0.0, 1.0 + sum(pause for pause, _ in turns), 0.02)
    by_scans, by_wheels = np.zeros(len(times)), np.zeros(len(times))
    for pause, late in turns:
        now += pause
        by_scans += bump(times - now)
        by_wheels += bump(times - now - late)
    for time, heading, by_wheel in zip(times, by_scans, by_wheels * wheels_turn, strict=True):
        wheels.add(Odometry(round(time * SECOND), np.array([0.0, 0.0, by_wheel]), np.zeros(3)))
        lag.add_turn(round(time * SECOND), heading - (by_scans[max(round(time / 0.02) - 1, 0)]))
    lag.learn(wheels)
    return lag


def bump(seconds: np.ndarray) -> np.ndarray:
    return np.asarray(np.exp(-((seconds / 0.3) ** 2)))


@pytest.mark.parametrize(
    ("turns", "lag"),
    [
        ([(2.0, 0.14)] * 5, 0.14),
        ([(2.0, 0.4)] * 5, 0.4),
        ([(2.0, 0.5)] * 5, 0.0),  # the bound of those that are tried
        ([(2.0, 0.7)] * 5, 0.0),
        ([(2.0, 0.0)] * 4 + [(2.0, 0.14)], 0.0),
        ([(2.0, 0.3), (2.0, -0.3)] * 3, 0.0),
    ],
)
def test_turns_that_agree_show_a_lag(turns: list[tuple[float, float]], lag: float) -> None:
    assert learned_from(turns).nanoseconds * 1e-9 == pytest.approx(lag, abs=0.01 if lag else 0.0)


def test_turns_by_hand_say_nothing() -> None:
    lag = learned_from([(2.0, 0.14)] * 5, wheels_turn=False)
    assert lag.nanoseconds == 0 and not lag.known.is_settled


def test_a_lag_that_was_known_holds_until_many_turns_show_none() -> None:
    lag = OdometryLag(100_000_000)
    lag.learn(OdometryBuffer())
    assert lag.nanoseconds == 100_000_000
    known = learned_from([(2.0, 0.0)] * 8)
    known.nanoseconds = 100_000_000
    assert known.known.is_settled
    known.learn(OdometryBuffer())
    assert known.nanoseconds == 0
