"""What the node's log and its diagnostics say of where the car is."""

from racecar.pipelines.live.monitoring.whereabouts import Whereabouts
from tests.localization.verdict.estimates import WRONG, estimate, straight_drive


def test_found_is_said_once_and_again_after_the_car_was_lost() -> None:
    log: list[str] = []
    whereabouts = Whereabouts(log.append)
    for seconds, lost in ((0.0, 0.5), (0.1, 0.4), (0.2, 0.01), (0.3, 0.01), (0.4, 0.3), (0.5, 0.01)):
        whereabouts.follow(estimate(seconds, 1.5, yaw=0.25, lost=lost))
    assert log == ["Found: the car is at x 1.50 m, y 0.00 m, yaw 0.25 rad."]
    for seconds, lost in ((0.6, 0.9), (0.7, 0.01)):
        whereabouts.follow(estimate(seconds, 7.0, lost=lost))
    assert log[1:] == ["Found: the car is at x 7.00 m, y 0.00 m, yaw 0.00 rad."]


def test_a_wide_cloud_is_not_found() -> None:
    log: list[str] = []
    whereabouts = Whereabouts(log.append)
    whereabouts.follow(estimate(0.0, 0.0, deviation=1.0))
    whereabouts.follow(estimate(0.1, 0.0, weight=0.5))
    assert log == []


def test_diagnostics_give_the_verdict_of_the_command() -> None:
    whereabouts = Whereabouts(lambda sentence: None)
    for each in straight_drive(10.0):
        whereabouts.follow(each)
    assert whereabouts.figures["drive so far"] == "localized"
    assert whereabouts.figures["share of it with a known place"] == 1.0
    assert whereabouts.figures["doubt"] == "none"
    for each in straight_drive(30.0, margin=WRONG, begin=10.0):
        whereabouts.follow(each)
    assert whereabouts.figures["drive so far"] == "lost"
    assert "map of another place" in whereabouts.figures["doubt"]


def test_a_car_that_is_still_being_found_is_not_called_lost() -> None:
    whereabouts = Whereabouts(lambda sentence: None)
    told = []
    for seconds, lost in ((0.0, 0.9), (0.2, 0.9), (0.4, 0.01), (0.5, 0.9)):
        whereabouts.follow(estimate(seconds, 0.0, lost=lost))
        told.append(whereabouts.may_be_lost)
    assert told == [False, False, False, True]


def test_a_car_that_is_never_found_is_called_lost_in_the_end() -> None:
    whereabouts = Whereabouts(lambda sentence: None)
    for tenths in range(12):
        whereabouts.follow(estimate(0.1 * tenths, 0.0, lost=0.9))
    assert whereabouts.may_be_lost
