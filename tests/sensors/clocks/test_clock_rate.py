"""How clocks run beside each other, and at which pace a bag is played."""

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecar.sensors.clocks.clock_offset import ClockOffset
from racecar.sensors.clocks.clock_rate import ClockRate, drift_finding
from racecar.sensors.clocks.stamp_pace import StampPace

SECOND = 10**9


def clock(rate: float, delay: float, seconds: float = 60.0, seed: int = 0) -> ClockRate:
    """Whose stamps gain so much a second, of messages that are recorded with a random delay."""
    found = ClockRate()
    delays = np.random.default_rng(seed).exponential(delay, round(seconds * 50))
    for index, late in enumerate(delays.tolist()):
        time = 0.02 * index
        found.add(round((time * (1.0 + rate) + 7.0) * SECOND), round((time + late) * SECOND))
    return found


@pytest.mark.parametrize("rate", [0.02, -0.01])
@pytest.mark.parametrize("both", [0.0, -0.5])
def test_a_clock_that_runs_faster_or_slower_is_told(rate: float, both: float) -> None:
    """Also where the recording was played at another speed."""
    (finding,) = drift_finding("/odom", clock(both + rate, 0.01), "/scan", clock(both, 0.02, seed=1))
    assert finding.numbers["gains"] == ("gains" if rate > 0.0 else "loses")
    assert finding.numbers["milliseconds"] == pytest.approx(abs(rate) * 1e3, abs=0.5)


@pytest.mark.parametrize("delay", [0.0, 0.01, 0.3])
def test_delays_are_no_drift(delay: float) -> None:
    assert drift_finding("/odom", clock(0.0, delay), "/scan", clock(0.0, 0.02, seed=1)) == []


def test_what_mapper_and_localizer_bear_is_not_told() -> None:
    assert drift_finding("/odom", clock(0.002, 0.001), "/scan", clock(0.0, 0.001, seed=1)) == []
    assert drift_finding("/odom", clock(0.1, 0.001, 0.5), "/scan", clock(0.0, 0.001, 0.5, 1)) == []
    assert drift_finding("/odom", ClockRate(), "/scan", clock(0.0, 0.01)) == []


def test_of_a_long_recording_a_part_is_enough() -> None:
    found = clock(0.01, 0.0, 600.0).drift()
    assert found is not None and found[0] == pytest.approx(0.01)


PERIOD = SECOND // 50
PAUSE = 30 * SECOND


def missing(pace: int, behind: int) -> list[int]:
    """What was found of odometry so much behind, in a bag with a pause that is played at a pace, whose scans
    are taken in a second late."""
    clocks, found, scans = ClockOffset(), [], []
    for k in range(1000):
        header = k * PERIOD * pace + (PAUSE if k >= 500 else 0)
        arrival = header // pace
        scans.append((arrival, header - arrival))
        taken_in = [each for each in scans if each[0] <= arrival - SECOND]
        scans = [each for each in scans if each[0] > arrival - SECOND]
        found.append(clocks.from_scans(arrival, header - behind - arrival, taken_in, pace))
    return [each for each in found if each]


@pytest.mark.parametrize("pace", [1, 10])
def test_scans_that_waited_do_not_make_clocks_disagree(pace: int) -> None:
    assert missing(pace, 0) == []


@pytest.mark.parametrize("pace", [1, 10])
def test_clocks_that_disagree_are_found(pace: int) -> None:
    assert missing(pace, 5 * SECOND)[0] == pytest.approx(5 * SECOND, rel=0.01)


TICK = SECOND // 40


def drive(speed: float, seconds: float = 5.0) -> Iterator[tuple[int, int]]:
    """Headers and arrivals."""
    for i in range(round(seconds * speed * SECOND / TICK)):
        yield i * TICK, round(i * TICK / speed)


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
