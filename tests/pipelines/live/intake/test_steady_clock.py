"""Stamps go on steadily whatever is done to the car's clock."""

from hypothesis import given
from hypothesis import strategies as st

from racecar.pipelines.live.intake.steady_clock import SteadyClock, TopicClock

PERIOD = 25_000_000
SECOND = 1_000_000_000
WALL = 1_700_000_000 * SECOND


def clock(shared: SteadyClock | None = None) -> tuple[TopicClock, list[float]]:
    jumps: list[float] = []
    return TopicClock(shared or SteadyClock(), jumps.append), jumps


def test_stamps_of_a_clock_that_is_left_alone_are_its_own() -> None:
    topic, jumps = clock()
    headers = [WALL + i * PERIOD for i in range(100)]
    assert [topic.steady(header, i * PERIOD) for i, header in enumerate(headers)] == headers
    assert jumps == []


@given(st.integers(-(10**5), 10**5).filter(lambda seconds: seconds > 3 or seconds < -2))
def test_a_jump_costs_one_message_and_leaves_no_gap(seconds: int) -> None:
    topic, jumps = clock()
    for i in range(10):
        topic.steady(WALL + i * PERIOD, i * PERIOD)
    after = [topic.steady(WALL + i * PERIOD + seconds * SECOND, i * PERIOD) for i in range(10, 20)]
    assert after == [None, *(WALL + i * PERIOD for i in range(11, 20))]
    assert [round(jump) for jump in jumps] == [seconds]


def test_two_topics_agree_on_a_jump_to_the_nanosecond() -> None:
    shared = SteadyClock()
    (scans, _), (odometry, _) = clock(shared), clock(shared)
    late = 3_000_000
    for i in range(5):
        scans.steady(WALL + i * PERIOD, i * PERIOD + late * (i % 2))
        odometry.steady(WALL + i * PERIOD, i * PERIOD)
    back = 10 * SECOND
    for i in range(5, 8):
        scan = scans.steady(WALL + i * PERIOD - back, i * PERIOD + late * (i % 3))
        sample = odometry.steady(WALL + i * PERIOD - back, i * PERIOD)
    assert scan == sample


@given(st.integers(0, 900))
def test_topics_agree_on_a_jump_although_one_waited_on_a_busy_machine(milliseconds: int) -> None:
    shared = SteadyClock()
    (scans, _), (odometry, _) = clock(shared), clock(shared)
    back, late = 10 * SECOND, 1_000_000 * milliseconds
    for i in range(10):
        header = WALL + i * PERIOD - back * (i >= 5)
        scan = scans.steady(header, i * PERIOD + late * (i >= 5))
        sample = odometry.steady(header, i * PERIOD)
    assert scan == sample


def test_a_clock_that_is_set_back_and_forth_ends_where_it_was() -> None:
    topic, _ = clock()
    shift = 0
    for i in range(60):
        if i in (20, 40):
            shift += 3600 * SECOND if i == 20 else -3600 * SECOND
        steady = topic.steady(WALL + i * PERIOD + shift, i * PERIOD)
    assert steady == WALL + 59 * PERIOD


def test_one_stray_stamp_is_left_out() -> None:
    topic, jumps = clock()
    topic.steady(WALL, 0)
    assert topic.steady(WALL + 10**6 * SECOND, PERIOD) is None
    assert topic.steady(WALL + 2 * PERIOD, 2 * PERIOD) == WALL + 2 * PERIOD
    assert jumps == []


def test_messages_that_waited_for_a_busy_node_are_no_jump() -> None:
    topic, jumps = clock()
    topic.steady(WALL, 0)
    steady = [topic.steady(WALL + i * PERIOD, 20 * SECOND) for i in range(1, 50)]
    assert steady == [WALL + i * PERIOD for i in range(1, 50)]
    assert jumps == []


def test_a_bag_played_fast_is_no_jump() -> None:
    topic, jumps = clock()
    for i in range(100):
        assert topic.steady(WALL + i * PERIOD * 20, i * PERIOD) == WALL + i * PERIOD * 20
    assert jumps == []


def test_messages_without_stamps_bear_the_time_of_their_arrival() -> None:
    shared = SteadyClock()
    (scans, _), (odometry, _) = clock(shared), clock(shared)
    odometry.steady(WALL, 7)
    assert scans.steady(0, 7 + PERIOD) == WALL + PERIOD


def test_a_drive_that_is_carried_on_does_not_go_back_in_time() -> None:
    shared = SteadyClock(after=WALL)
    (scans, _), (odometry, _) = clock(shared), clock(shared)
    earlier = WALL - 500 * SECOND
    first, second = scans.steady(earlier, 0), odometry.steady(earlier + PERIOD, PERIOD)
    assert first is not None
    assert second is not None
    assert WALL < first < second == first + PERIOD
    later, _ = clock(SteadyClock(after=WALL))
    assert later.steady(WALL + SECOND, 0) == WALL + SECOND
