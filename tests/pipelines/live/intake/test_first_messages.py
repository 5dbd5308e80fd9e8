"""What waits at the start of a drive, for how long, and what is left out."""

from collections.abc import Callable

from racecar.pipelines.live.intake.first_messages import FirstMessages

SCAN, ODOMETRY = True, False


def told(first: FirstMessages, *messages: tuple[bool, float]) -> list[list[float]]:
    """The times of what is to be mapped after each message, in seconds."""
    return [
        [round(arrival * 1e-9, 3) for _, _, arrival in first.add(is_scan, "message", round(seconds * 1e9))]
        for is_scan, seconds in messages
    ]


def first_messages(
    knows_place: Callable[[object], bool], understands: Callable[[object], bool] = lambda messages: True
) -> FirstMessages:
    return FirstMessages(knows_place, understands)


def test_scans_wait_for_odometry_and_those_from_before_it_are_left_out() -> None:
    first = first_messages(lambda message: True)
    assert told(first, (SCAN, 0.0), (SCAN, 1.0), (ODOMETRY, 1.5), (SCAN, 1.6)) == [[], [], [1.5], [1.6]]
    assert first.are_taken


def test_odometry_waits_for_a_scan() -> None:
    first = first_messages(lambda message: True)
    assert told(first, (ODOMETRY, 0.0), (ODOMETRY, 9.0), (SCAN, 9.1)) == [[], [], [0.0, 9.0, 9.1]]


def test_a_car_without_odometry_does_not_wait_for_ever() -> None:
    first = first_messages(lambda message: True)
    assert told(first, (SCAN, 0.0), (SCAN, 2.0), (SCAN, 2.5)) == [[], [], [0.0, 2.0, 2.5]]


def test_nor_does_a_car_that_never_tells_where_its_laser_sits() -> None:
    first = first_messages(lambda message: False)
    assert told(first, (ODOMETRY, 0.0), (SCAN, 0.1), (SCAN, 2.2)) == [[], [], [0.0, 0.1, 2.2]]


def test_all_goes_on_once_the_laser_is_known() -> None:
    is_known: list[bool] = []
    first = first_messages(lambda message: bool(is_known))
    assert told(first, (ODOMETRY, 0.0), (SCAN, 0.1)) == [[], []]
    is_known.append(True)
    assert told(first, (ODOMETRY, 0.2)) == [[0.0, 0.1, 0.2]]


def test_odometry_that_comes_for_hours_is_not_kept() -> None:
    first = first_messages(lambda message: True)
    told(first, *((ODOMETRY, 0.02 * k) for k in range(10_000)))
    (taken,) = told(first, (SCAN, 200.0))
    assert len(taken) < 5000
    assert taken[-2:] == [199.98, 200.0]


def test_all_waits_until_the_messages_are_understood() -> None:
    first = first_messages(lambda message: True, lambda messages: len(messages) > 3)
    assert told(first, (ODOMETRY, 0.0), (SCAN, 0.1), (ODOMETRY, 0.2), (SCAN, 0.3)) == [
        *([[]] * 3),
        [0.0, 0.1, 0.2, 0.3],
    ]


def test_what_comes_after_all_patience_is_understood_as_well_as_can_be() -> None:
    looked_at: list[int] = []
    first = first_messages(lambda message: False, lambda messages: bool(looked_at.append(len(messages))))
    assert told(first, (SCAN, 0.0), (SCAN, 1.0), (SCAN, 2.5)) == [[], [], [0.0, 1.0, 2.5]]
    assert looked_at == [3]
