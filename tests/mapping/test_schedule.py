"""When the mapper does what it does from time to time."""

from racecar.mapping.config import ScheduleConfig


def test_wheels_are_calibrated_early_then_ever_more_rarely_and_at_last_at_an_interval() -> None:
    schedule = ScheduleConfig(first_calibration=8, calibration_interval=50)
    assert [k for k in range(160) if schedule.calibrates_at(k)] == [8, 16, 32, 50, 100, 150]


def test_a_first_calibration_after_the_interval_is_none() -> None:
    schedule = ScheduleConfig(first_calibration=80, calibration_interval=50)
    assert [k for k in range(160) if schedule.calibrates_at(k)] == [50, 100, 150]
