import math

import pytest

from racecar.sensors.motion.gyro_buffer import GyroBuffer, turn_between
from racecar.sensors.yaw_rate import YawRate

MILLISECOND = 1_000_000


def filled(rates: list[float], period: int = 100) -> GyroBuffer:
    """Samples every ``period`` milliseconds from 0 on."""
    buffer = GyroBuffer()
    for k, rate in enumerate(rates):
        buffer.add(YawRate(k * period * MILLISECOND, rate))
    return buffer


def turn(buffer: GyroBuffer, begin: float, end: float) -> float:
    """Between two times in milliseconds."""
    return turn_between(
        buffer.reading_at(round(begin * MILLISECOND)), buffer.reading_at(round(end * MILLISECOND))
    )


def test_rates_that_grow_are_summed_up_exactly_between_samples_too() -> None:
    buffer = filled([0.0, 1.0, 2.0, 3.0])  # 10 rad/s²
    assert turn(buffer, 0, 300) == pytest.approx(0.45)
    assert turn(buffer, 50, 250) == pytest.approx(5.0 * (0.25**2 - 0.05**2))


def test_the_last_rate_lasts_until_the_next_sample_should_have_come() -> None:
    buffer = filled([0.0, 2.0])
    assert turn(buffer, 100, 200) == pytest.approx(0.2)
    assert math.isnan(turn(buffer, 100, 300))
    assert math.isnan(turn(buffer, -100, 100))


def test_over_a_gap_nothing_is_known() -> None:
    buffer = filled([0.0, 1.0])
    before = buffer.reading_at(100 * MILLISECOND)
    for k in range(3):
        buffer.add(YawRate((900 + 100 * k) * MILLISECOND, 1.0))
    assert math.isnan(turn_between(before, buffer.reading_at(1100 * MILLISECOND)))
    assert turn(buffer, 900, 1100) == pytest.approx(0.2)


def test_what_is_late_twice_or_no_number_is_left_out() -> None:
    buffer = filled([1.0, 1.5, 1.0])
    for stamp, rate in ((200, 9.0), (100, 9.0), (250, math.nan), (250, math.inf)):
        buffer.add(YawRate(stamp * MILLISECOND, rate))
    assert len(buffer) == 3
    assert turn(buffer, 0, 200) == pytest.approx(0.25)


@pytest.mark.parametrize("rate", [0.0, 0.3])
def test_one_number_for_ever_is_no_gyroscope(rate: float) -> None:
    buffer = filled([rate] * 50)
    assert buffer.reading_at(MILLISECOND) is None
    buffer.add(YawRate(5000 * MILLISECOND, 0.1))
    assert turn(buffer, 0, 4900) == pytest.approx(4.9 * rate)


def test_one_that_dies_says_nothing_until_it_lives_again() -> None:
    """What the car turned meanwhile is not known."""
    buffer = filled([0.1, 0.2, 0.3])
    before = buffer.reading_at(200 * MILLISECOND)
    for k in range(3, 30):
        buffer.add(YawRate(100 * k * MILLISECOND, 0.0))
        dead_for = 100 * (k - 3)
        assert (buffer.reading_at(100 * k * MILLISECOND) is None) == (dead_for > 1000)
    for k in range(30, 33):
        buffer.add(YawRate(100 * k * MILLISECOND, 0.01 * k))
    after = buffer.reading_at(3200 * MILLISECOND)
    assert after is not None
    assert math.isnan(turn_between(before, after))
    assert turn(buffer, 3000, 3200) == pytest.approx(0.2 * 0.31)


def test_memory_is_bounded_and_angles_go_on() -> None:
    buffer = GyroBuffer(max_samples=10)
    for k in range(100):
        buffer.add(YawRate(k * 10 * MILLISECOND, 1.0 + 0.01 * (k % 2)))
    assert len(buffer) == 10
    reading = buffer.reading_at(990 * MILLISECOND)
    assert reading is not None
    assert reading.angle == pytest.approx(0.99 * 1.005)
