"""When the mapper does what it does from time to time."""

import pytest

from racecar.mapping.schedule import calibrates_at


@pytest.mark.parametrize("stretch", [0.1, 1.0])
def test_wheels_are_calibrated_at_an_interval(stretch: float) -> None:
    assert [k for k in range(160) if calibrates_at(k, stretch)] == [0, 50, 100, 150]


def test_they_are_calibrated_as_often_per_metre_where_keyframes_lie_far_apart() -> None:
    assert [k for k in range(31) if calibrates_at(k, 6.6)] == [0, 8, 16, 24]


def test_they_are_calibrated_at_once_after_a_long_gap() -> None:
    assert all(calibrates_at(k, 100.0) for k in range(5))
