"""A gyroscope and wheels beside scans that show the turn: who is believed, and by how much."""

from collections.abc import Callable
from math import nan

import numpy as np
import pytest
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import compose
from racecar.sensors.motion.turn_fusion import TurnFusion

STEP = 0.2
"""Seconds between two scans."""
BIAS = np.radians(3.0)

Sensor = Callable[[NDArray[np.float64], np.random.Generator], NDArray[np.float64]]


def gyro(rates: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    return rates + BIAS + 0.001 * rng.standard_normal(len(rates))


def slow_gyro(rates: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Every other turn is lost."""
    return np.where(np.arange(len(rates)) // 5 % 2, rates, 0.0) + 0.001 * rng.standard_normal(len(rates))


def good_wheels(rates: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    return rates * (1.0 + 0.01 * rng.standard_normal(len(rates)))


def slipping_wheels(rates: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    return rates * (1.0 + np.where(np.abs(rates) > 0.5, 0.3, 0.0))


def no_wheels(rates: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    return np.full(len(rates), nan)


def learned(
    by_gyro: Sensor, by_wheels: Sensor, seconds: float = 60.0, standing: float = 0.0, speed: float = 1.0
) -> TurnFusion:
    """Bends of up to 1 rad/s after a while of standing, at a ``speed`` by the wheels in m/s."""
    rng = np.random.default_rng(0)
    fusion = TurnFusion()
    times = STEP * np.arange(round((standing + seconds) / STEP))
    is_driving = times >= standing
    rates = np.where(is_driving, np.sin(0.7 * times) * (np.sin(0.2 * times) > 0), 0.0)
    measured, rolled = by_gyro(rates, rng), by_wheels(rates, rng)
    jitter = np.diff(0.002 * rng.standard_normal(len(rates) + 1))
    for k, rate in enumerate(rates):
        step = np.array([STEP * speed * is_driving[k], 0.0, STEP * rolled[k]])
        wheel_step = None if np.isnan(rolled[k]) else step
        fusion.follow(STEP, STEP * rate + jitter[k], STEP * measured[k], wheel_step)
    return fusion


def turned(fusion: TurnFusion, by_wheels: float, by_gyro: float, metres: float = 1.0) -> float:
    """In one second."""
    return float(fusion.model.fused(np.array([metres, 0.0, by_wheels]), by_gyro, 1.0)[2])


@pytest.mark.parametrize("wheels", [good_wheels, slipping_wheels, no_wheels])
def test_bias_and_scale_are_learned(wheels: Sensor) -> None:
    model = learned(lambda rates, rng: 1.02 * gyro(rates, rng), wheels).model
    assert model.is_believed
    assert model.by_gyro(1.02 * BIAS + 1.02 * 0.5, 1.0) == pytest.approx(0.5, abs=np.radians(0.2))


def test_a_minute_of_standing_shows_the_bias_well() -> None:
    model = learned(gyro, good_wheels, seconds=10.0, standing=60.0).model
    assert model.bias == pytest.approx(BIAS, abs=np.radians(0.02))


def test_the_better_of_both_decides() -> None:
    by_gyro = turned(learned(gyro, slipping_wheels), by_wheels=1.3, by_gyro=1.0 + BIAS)
    assert by_gyro == pytest.approx(1.0, abs=0.02)
    by_wheels = turned(learned(slow_gyro, good_wheels), by_wheels=1.0, by_gyro=0.5)
    assert by_wheels == pytest.approx(1.0, abs=0.02)


def test_a_car_whose_wheels_stand_does_not_turn_by_a_bias() -> None:
    fusion = learned(gyro, slipping_wheels)
    assert fusion.model.is_believed
    drifted = turned(fusion, by_wheels=0.0, by_gyro=BIAS + np.radians(1.0), metres=0.0)
    assert abs(drifted) < np.radians(0.2)


def test_wheels_that_stand_while_the_car_turns_are_found_out() -> None:
    fusion = learned(gyro, lambda rates, rng: np.zeros(len(rates)), speed=0.0)
    assert turned(fusion, by_wheels=0.0, by_gyro=0.5 + BIAS, metres=0.0) == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize(
    ("wrong", "scale"),
    [(np.degrees, 1 / 57.3), (np.negative, -1.0), (lambda rates: 2.0 * rates, 0.5)],
    ids=["degrees", "upside down", "doubled"],
)
def test_another_scale_is_not_believed(wrong: Callable[..., NDArray[np.float64]], scale: float) -> None:
    fusion = learned(lambda rates, rng: wrong(gyro(rates, rng)), good_wheels)
    assert fusion.model.is_contradicted
    assert fusion.model.scale == pytest.approx(scale, rel=0.05)
    assert turned(fusion, by_wheels=0.4, by_gyro=9.0) == 0.4


@pytest.mark.parametrize(
    ("factors", "what", "remedy"),
    [
        ((2.0, 1.0), "does not turn as they do", "--no-imu"),
        ((-1.0, 1.0), "hangs upside down", "/tf_static"),
        ((1.3, 1.3), "which agree with each other", "angle_increment"),
    ],
    ids=["the gyroscope is wrong", "upside down", "the scans are wrong"],
)
def test_what_is_wrong_and_what_to_do_are_said(factors: tuple[float, float], what: str, remedy: str) -> None:
    model = learned(lambda rates, _: factors[0] * rates, lambda rates, _: factors[1] * rates).model
    assert model.contradiction is not None and what in model.contradiction
    assert remedy in model.remedy


@pytest.mark.parametrize("noise", [1e-6, 1e-3, 0.05])
def test_one_that_does_not_turn_along_is_not_believed(noise: float) -> None:
    fusion = learned(lambda rates, rng: noise * rng.standard_normal(len(rates)), good_wheels)
    assert not fusion.model.is_used
    assert fusion.model.is_contradicted


def test_nothing_is_believed_before_the_car_has_turned() -> None:
    fusion = learned(lambda rates, rng: gyro(0.0 * rates, rng), good_wheels, seconds=1.0, standing=30.0)
    assert not fusion.model.is_used
    assert not fusion.model.is_contradicted


def test_wheels_that_know_no_turns_leave_them_to_the_gyroscope_at_once() -> None:
    fusion = TurnFusion()
    for _ in range(20):
        fusion.watch(np.array([0.05, 0.0, 0.0]), STEP * BIAS, STEP)
    assert not fusion.model.is_used  # that may be a bias
    for _ in range(3):
        fusion.watch(np.array([0.05, 0.0, 0.0]), STEP * 1.0, STEP)
    assert turned(fusion, by_wheels=0.0, by_gyro=0.7) == pytest.approx(0.7)
    fusion.watch(np.array([0.05, 0.0, 0.001]), STEP * 1.0, STEP)
    assert not fusion.model.is_used


def test_the_step_bends_with_the_turn() -> None:
    """Half a circle whose wheels say straight ahead ends where half circles of that length end."""
    fusion = TurnFusion()
    fusion.watch(np.array([1.0, 0.0, 0.0]), 1.0, 0.1)
    pose = np.zeros(3)
    for _ in range(100):
        step = fusion.model.fused(np.array([np.pi / 100, 0.0, 0.0]), np.pi / 100, 0.1)
        pose = compose(pose, step)
    np.testing.assert_allclose(pose[:2], [0.0, 2.0], atol=1e-3)
    assert abs(pose[2]) == pytest.approx(np.pi)


def test_a_gap_ends_a_segment() -> None:
    whole, torn = learned(gyro, good_wheels), learned(gyro, good_wheels)
    before = torn.model
    for _ in range(20):
        torn.follow(STEP, 1.0, nan, None)
        torn.follow(STEP, 1.0, 1.0, None)
    assert torn.model is before
    assert whole.model == before
