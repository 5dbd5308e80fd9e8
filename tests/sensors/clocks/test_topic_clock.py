"""Stamps go on steadily whatever is done to the car's clocks."""

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from racecar.sensors.clocks.topic_clock import SteadyClock, TopicClock

PERIOD = 25_000_000
SECOND = 1_000_000_000
WALL = 1_700_000_000 * SECOND


@dataclass
class Reports:
    """What was said."""

    jumps: list[float] = field(default_factory=list)
    astray: int = 0
    still: list[bool] = field(default_factory=list)
    corrections: list[float] = field(default_factory=list)

    def jumped(self, seconds: float) -> None:
        self.jumps.append(seconds)

    def went_astray(self) -> None:
        self.astray += 1

    def stood_still(self, is_still: bool) -> None:
        self.still.append(is_still)

    def disagreed(self, seconds: float) -> None:
        self.corrections.append(seconds)


def clock(shared: SteadyClock | None = None, *, is_reference: bool = False) -> tuple[TopicClock, Reports]:
    reports = Reports()
    return TopicClock(shared or SteadyClock(), reports, is_reference=is_reference), reports


def pair() -> tuple[TopicClock, TopicClock, Reports, Reports]:
    """Scans and odometry."""
    shared = SteadyClock()
    scans, of_scans = clock(shared, is_reference=True)
    odometry, of_odometry = clock(shared)
    return scans, odometry, of_scans, of_odometry


Message = tuple[int, int, int | None]
"""A header, its arrival, and the stamp that is right."""


def shifted(count: int, shift: Callable[[int], float]) -> list[Message]:
    """Of a clock that is off by some seconds at each message."""
    times = [i * PERIOD for i in range(count)]
    return [(WALL + time + round(shift(i) * SECOND), time, WALL + time) for i, time in enumerate(times)]


def played(*parts: tuple[int, int, int, float]) -> list[Message]:
    """Each part at a pace, so many messages, after seconds that the recording and the player paused."""
    header, arrival, messages = WALL, 0, []
    for pace, count, later, waited in parts:
        header, arrival = header + later * SECOND, arrival + round(waited * SECOND)
        for _ in range(count):
            header, arrival = header + PERIOD, arrival + PERIOD // pace
            messages.append((header, arrival, header))
    return messages


def received(
    speed: float, period: int, busy_from: float, busy_for: float, first: int, newest: int
) -> list[tuple[int, int]]:
    """Headers and arrivals at a node that is busy for some seconds. What is sent meanwhile comes when
    they are over, but only so many of the first and of the newest, as a full queue drops the others."""
    sent = [
        (WALL + i * period, round(i * period / speed))
        for i in range(round((busy_from + busy_for + 2) * speed * SECOND / period))
    ]
    begin, end = round(busy_from * SECOND), round((busy_from + busy_for) * SECOND)
    before = [each for each in sent if each[1] <= begin]
    waited = [(header, end) for header, arrival in sent if begin < arrival < end]
    kept = [each for i, each in enumerate(waited) if i < first or i >= len(waited) - newest]
    return before + kept + [each for each in sent if each[1] >= end]


def later(messages: list[Message], after: int) -> list[Message]:
    """Of a clock that is set by a minute after an arrival."""
    return [(header + 60 * SECOND * (at > after), at, right) for header, at, right in messages]


ALONE = shifted(100, lambda _: 0.0)
STRAY = {1: 300, 3: 600, 4: 900}
PAUSES = [(f"a pause, played {pace} x", pace) for pace in (1, 2, 10, 50)]
SINGLE_CLOCKS: list[tuple[str, list[Message], list[int], int, int]] = [
    ("left alone", ALONE, [], 0, 0),
    ("set back and forth", shifted(60, lambda i: 3600.0 * (20 <= i < 40)), [3600, -3600], 0, 0),
    ("set twice at once", shifted(80, lambda i: 5.0 * (i >= 40) + 7.0 * (i >= 44)), [5, 7], 0, 0),
    ("stray stamps", shifted(6, lambda i: 3600.0 * STRAY.get(i, 0)), [], 3, 0),
    (
        "a busy node",
        [(header, min(arrival * 800, 20 * SECOND), header) for header, arrival, _ in ALONE],
        [],
        0,
        0,
    ),
    ("sent often", [(h, at + k * 100_000, h) for h, at, _ in ALONE for k in range(20)], [], 0, 0),
    *((name, played((pace, 4000, 0, 0.0), (pace, 4000, 33, 33 / pace)), [], 0, 1) for name, pace in PAUSES),
    ("a slow player", played((10, 800, 0, 0.0), (4, 1600, 31, 0.1), (10, 800, 31, 0.1)), [], 0, 2),
    ("played again", [(WALL + i % 2000 * PERIOD, i * PERIOD // 10, None) for i in range(4000)], [-50], 0, 0),
    ("set after play", later(played((10, 200, 0, 0.0), (1, 400, 0, 0.0)), 6 * SECOND), [60], 0, 0),
    *(
        (
            "set after a loss",
            later([(h, at, h) for h, at in received(1.0, PERIOD, 3.0, 5.0, first, 40)], 9 * SECOND),
            [60],
            0,
            0,
        )
        for first in (0, 1)
    ),
]


@pytest.mark.parametrize(
    ("messages", "jumps", "astray", "pauses"),
    [each[1:] for each in SINGLE_CLOCKS],
    ids=[each[0] for each in SINGLE_CLOCKS],
)
def test_stamps_go_on_steadily_and_what_was_done_to_the_clock_is_reported(
    messages: list[Message], jumps: list[int], astray: int, pauses: int
) -> None:
    """A jump costs one message, a stray stamp itself, and a pause in what is played fast one at most."""
    (topic, reports), left_out = clock(), 0
    for header, arrival, right in messages:
        steady = topic.steady(header, arrival)
        assert steady in (right, None) or right is None
        left_out += steady is None
    assert [round(jump) for jump in reports.jumps] == jumps
    assert reports == Reports(jumps=reports.jumps, astray=astray)
    assert 0 <= left_out - len(jumps) - astray <= pauses


@given(st.integers(-(10**5), 10**5).filter(lambda seconds: seconds > 3 or seconds < -2))
def test_a_jump_costs_one_message_and_leaves_no_gap(seconds: int) -> None:
    topic, reports = clock()
    messages = shifted(20, lambda i: float(seconds * (i >= 10)))
    steady = [topic.steady(header, arrival) for header, arrival, _ in messages]
    assert steady == [None if i == 10 else right for i, (_, _, right) in enumerate(messages)]
    assert [round(jump) for jump in reports.jumps] == [seconds]


@given(st.integers(0, 900), st.integers(0, 3))
def test_topics_agree_on_a_jump_although_one_waited_on_a_busy_machine(waited: int, jitter: int) -> None:
    """To the nanosecond, after some milliseconds."""
    scans, odometry, _, _ = pair()
    for i in range(10):
        header = WALL + i * PERIOD - 10 * SECOND * (i >= 5)
        scan = scans.steady(header, i * PERIOD + 1_000_000 * (waited * (i >= 5) + jitter * (i % 3)))
        sample = odometry.steady(header, i * PERIOD)
    assert scan == sample


@pytest.mark.parametrize("speed", [0.05, 5.0, 20.0])
def test_a_bag_played_at_another_speed_is_no_jump_and_no_offset(speed: float) -> None:
    """The slower topic once a second, as its delays seem to differ most from the other's."""
    scans, odometry, of_scans, of_odometry = pair()
    for i in range(500):
        recorded = i * PERIOD
        arrival = round(recorded / speed)
        if i % 40 == 17:
            assert odometry.steady(WALL + recorded, arrival) == WALL + recorded
        else:
            assert scans.steady(WALL + recorded, arrival) == WALL + recorded
    assert of_scans == of_odometry == Reports()


@pytest.mark.parametrize("lost", [("scans",), ("odometry",), ("scans", "odometry")])
@settings(max_examples=20, deadline=None)
@given(
    st.sampled_from([1.0, 2.0, 10.0]),
    st.one_of(st.floats(0.0, 0.1), st.floats(0.5, 2.0)),  # between, a pace is known that is still rough
    st.one_of(st.floats(0.0, 0.5), st.floats(0.0, 5.0)),
    st.integers(0, 4),
    st.integers(1, 80),
)
@example(10.0, 0.0, 0.3, 1, 8)
@example(10.0, 2.0, 0.3, 0, 8)
def test_messages_lost_by_a_busy_node_set_no_clock(
    lost: tuple[str, ...], speed: float, busy_from: float, busy_for: float, first: int, newest: int
) -> None:
    scans, odometry, of_scans, of_odometry = pair()
    messages = []
    for name, topic, period in (("scans", scans, PERIOD), ("odometry", odometry, PERIOD * 4 // 5)):
        kept = (first, newest) if name in lost else (0, 10**6)
        messages += [
            (arrival, topic, header)
            for header, arrival in received(speed, period, busy_from, busy_for, *kept)
        ]
    left_out = 0
    for arrival, topic, header in sorted(messages, key=lambda each: each[0]):
        steady = topic.steady(header, arrival)
        assert steady in (header, None)
        left_out += steady is None
    assert left_out <= 2
    assert of_scans == of_odometry == Reports()


def test_a_bag_that_was_paused_while_it_was_played_is_no_fault() -> None:
    scans, odometry, of_scans, of_odometry = pair()
    for i in range(300):
        header, arrival = WALL + i * PERIOD, i * PERIOD + 100 * SECOND * (i > 150)
        assert odometry.steady(header, arrival) == header
        assert scans.steady(header, arrival + 1) == header
    assert of_scans == of_odometry == Reports()


def test_messages_without_stamps_bear_the_time_of_their_arrival() -> None:
    scans, odometry, of_scans, of_odometry = pair()
    for i in range(80):
        sample = odometry.steady(WALL + i * PERIOD, 7 + i * PERIOD)
        assert sample == WALL + i * PERIOD
        assert scans.steady(0, 7 + i * PERIOD + 5, sweep=3) == sample + 5 - 3
    assert of_scans == Reports(still=[True])
    assert of_odometry == Reports()


def test_a_car_without_any_stamps_has_the_time_of_the_computer() -> None:
    shared = SteadyClock(offset=WALL)
    (scans, _), (odometry, _) = clock(shared, is_reference=True), clock(shared)
    assert [scans.steady(0, i * PERIOD) for i in range(3)] == [WALL + i * PERIOD for i in range(3)]
    assert [odometry.steady(0, i * PERIOD) for i in range(3)] == [WALL + i * PERIOD for i in range(3)]


@pytest.mark.parametrize("frozen", ["scans", "odometry"])
@pytest.mark.parametrize("lost", [0, 3])
def test_stamps_that_stand_still_for_three_seconds(frozen: str, lost: int) -> None:
    """They go on where time is by now, or from where they stood (``lost`` seconds)."""
    scans, odometry, of_scans, of_odometry = pair()
    for i in range(400):
        now = WALL + i * PERIOD
        stopped = min(now, WALL + 80 * PERIOD) if i < 200 else now - lost * SECOND
        arrival = i * PERIOD + (i % 3) * 1_000_000
        scan = scans.steady(stopped if frozen == "scans" else now, arrival + 7)
        sample = odometry.steady(stopped if frozen == "odometry" else now, arrival)
        if not 81 <= i < 96:
            assert scan == pytest.approx(now, abs=5_000_000)
            assert sample == pytest.approx(now, abs=5_000_000)
    reports, others = (of_scans, of_odometry) if frozen == "scans" else (of_odometry, of_scans)
    assert reports.still == [True, False]
    assert [round(jump) for jump in reports.jumps] == ([-3] if lost else [])
    assert others == Reports()


@pytest.mark.parametrize("resolution", [SECOND, 10**15])
def test_stamps_of_whole_seconds_and_counters_show_no_time(resolution: int) -> None:
    topic, reports = clock()
    steady = [topic.steady(WALL + i * PERIOD // resolution * resolution + i, i * PERIOD) for i in range(400)]
    assert steady[80:] == pytest.approx([steady[0] + i * PERIOD for i in range(80, 400)], abs=SECOND)
    assert min(b - a for a, b in pairwise(steady[80:])) > 0.9 * PERIOD
    assert reports.still == [True]


@pytest.mark.parametrize("seconds", [-5.0, -3.0, -0.7, 0.7, 3.0, 5.0, 1.6e9])
def test_a_clock_that_is_off_is_set_right_within_a_second(seconds: float) -> None:
    """Of odometry at 50 Hz and scans at 10 Hz, which are sent when their sweep is over."""
    scans, odometry, of_scans, of_odometry = pair()
    sweep, is_off = 100_000_000, round(seconds * SECOND)
    for i in range(200):
        arrival = i * 20_000_000 + (i % 3) * 2_000_000
        sample = odometry.steady(WALL + i * 20_000_000 - is_off, arrival)
        if i % 5 == 0:
            scan = scans.steady(WALL + i * 20_000_000 - sweep, arrival + 5_000_000, sweep)
            assert scan == WALL + i * 20_000_000 - sweep
        if i > 60:
            assert sample == pytest.approx(WALL + i * 20_000_000, abs=20_000_000)
    assert of_scans == Reports()
    assert [round(each, 1) for each in of_odometry.corrections] == [pytest.approx(seconds, abs=0.1)]


def test_a_jump_of_one_clock_too_small_to_be_seen_alone() -> None:
    scans, odometry, of_scans, of_odometry = pair()
    for i in range(200):
        scan = scans.steady(WALL + i * PERIOD + (i > 40) * 1_500_000_000, i * PERIOD)
        sample = odometry.steady(WALL + i * PERIOD, i * PERIOD + 1)
    assert sample == pytest.approx(scan, abs=10)
    assert of_odometry.corrections == [pytest.approx(1.5)]
    assert of_scans == Reports()


def test_messages_that_are_late_now_and_then_are_no_clock_that_is_off() -> None:
    scans, odometry, _, of_odometry = pair()
    for i in range(400):
        odometry.steady(WALL + i * PERIOD, i * PERIOD)
        late = (i // 40 % 2) * (i % 40) * 30_000_000  # up to 1.2 s, and all come in their order
        scans.steady(WALL + i * PERIOD, i * PERIOD + late)
    assert of_odometry == Reports()


def test_a_sensor_that_begins_after_the_clock_was_set_agrees_with_the_others() -> None:
    shared = SteadyClock()
    scans, _ = clock(shared, is_reference=True)
    late, of_late = clock(shared)
    for i in range(200):
        header = WALL + i * PERIOD - 10 * SECOND * (i > 20)
        scan = scans.steady(header, i * PERIOD)
        if i > 40:
            assert late.steady(header, i * PERIOD) == scan == WALL + i * PERIOD
    assert of_late == Reports()


def test_a_drive_that_is_carried_on_does_not_go_back_in_time() -> None:
    shared = SteadyClock()
    shared.after = WALL
    (scans, _), (odometry, _) = clock(shared), clock(shared)
    earlier = WALL - 500 * SECOND
    first, second = scans.steady(earlier, 0), odometry.steady(earlier + PERIOD, PERIOD)
    assert first is not None
    assert second is not None
    assert WALL < first < second == first + PERIOD
    shared = SteadyClock()
    shared.after = WALL
    later, _ = clock(shared)
    assert later.steady(WALL + SECOND, 0) == WALL + SECOND
