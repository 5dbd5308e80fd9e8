"""A bag that is played fast is told from clocks that are set and from messages that wait."""

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.sensors.clocks.stamp_pace import StampPace

SECOND = 1_000_000_000
PERIOD = SECOND // 40


def drive(speed: float, seconds: float = 5.0) -> Iterator[tuple[int, int]]:
    """Headers and arrivals."""
    for i in range(round(seconds * speed * SECOND / PERIOD)):
        yield i * PERIOD, round(i * PERIOD / speed)


def factor(messages: Iterator[tuple[int, int]]) -> float:
    pace = StampPace()
    for header, arrival in messages:
        pace.follow(header, arrival)
    return pace.real_time_factor


@pytest.mark.parametrize("speed", [1.5, 4.0, 10.0, 100.0])
def test_the_speed_at_which_a_bag_is_played_is_known_within_a_second(speed: float) -> None:
    assert factor(drive(speed, 1.0)) == pytest.approx(speed, rel=0.1)


@pytest.mark.parametrize("speed", [0.1, 0.5, 1.0])
def test_a_drive_and_a_bag_played_slowly_go_as_a_clock_does(speed: float) -> None:
    assert factor(drive(speed)) == 1.0


def test_nothing_is_known_of_the_first_messages() -> None:
    assert factor(drive(1.0, 0.1)) >= 100.0


@given(st.integers(0, 2**32 - 1))
def test_messages_that_come_irregularly_are_not_fast(seed: int) -> None:
    late = np.random.default_rng(seed).uniform(0.0, 0.03, 400) * SECOND
    messages = ((header, arrival + round(late[i])) for i, (header, arrival) in enumerate(drive(1)))
    assert factor(messages) == 1.0


@pytest.mark.parametrize("speed", [1, 2, 10])
@settings(max_examples=20, deadline=None)
@given(st.floats(1.0, 4.0), st.floats(0.0, 4.0))
def test_messages_that_waited_while_the_node_was_busy_leave_the_pace_as_it_is(
    speed: int, begin: float, seconds: float
) -> None:
    """Until the moment at which they come at once."""
    end = round((begin + seconds) * SECOND)
    messages = (
        (header, max(arrival, end) if arrival > begin * SECOND else arrival)
        for header, arrival in drive(speed)
        if arrival <= end
    )
    assert factor(messages) == pytest.approx(speed, rel=0.1)


def test_a_stamp_is_ahead_of_messages_that_did_not_wait() -> None:
    pace = StampPace()
    for header, arrival in drive(1.0, 2.0):
        pace.follow(header, arrival)
    pace.follow(2 * SECOND, 12 * SECOND)
    assert pace.ahead(12 * SECOND, 12 * SECOND) == 0
    assert pace.ahead(15 * SECOND, 12 * SECOND) == 3 * SECOND
