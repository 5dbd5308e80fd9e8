"""A bag that is played fast is told from clocks that are set and from messages that wait."""

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecar.pipelines.live.intake.stamp_pace import StampPace

SECOND = 1_000_000_000
PERIOD = SECOND // 40


def drive(speed: float, seconds: float = 5.0) -> Iterator[tuple[int, int]]:
    """Headers and arrivals."""
    for i in range(round(seconds * speed * SECOND / PERIOD)):
        yield i * PERIOD, round(i * PERIOD / speed)


def is_played_fast(messages: Iterator[tuple[int, int]]) -> bool:
    pace = StampPace()
    for header, arrival in messages:
        pace.follow(header, arrival)
    return pace.is_played_fast


@pytest.mark.parametrize("speed", [1.5, 4.0, 10.0, 100.0])
def test_a_bag_that_is_played_fast_is_noticed_within_a_second(speed: float) -> None:
    assert is_played_fast(drive(speed, 1.0))


@pytest.mark.parametrize("speed", [0.1, 0.5, 1.0])
def test_a_drive_and_a_bag_played_slowly_are_not_fast(speed: float) -> None:
    assert not is_played_fast(drive(speed))


@given(st.integers(0, 199), st.integers(-(10**4), 10**4))
def test_a_clock_that_is_set_is_not_fast(when: int, seconds: int) -> None:
    messages = (
        (header + seconds * SECOND * (arrival > when * PERIOD), arrival) for header, arrival in drive(1)
    )
    assert not is_played_fast(messages)


@given(st.integers(0, 2**32 - 1))
def test_messages_that_come_irregularly_are_not_fast(seed: int) -> None:
    late = np.random.default_rng(seed).uniform(0.0, 0.03, 400) * SECOND
    messages = ((header, arrival + round(late[i])) for i, (header, arrival) in enumerate(drive(1)))
    assert not is_played_fast(messages)


def test_messages_that_waited_while_the_node_was_busy_are_not_fast() -> None:
    messages = (
        (header, max(arrival, 4 * SECOND) if header > 2 * SECOND else arrival) for header, arrival in drive(1)
    )
    assert not is_played_fast(messages)
