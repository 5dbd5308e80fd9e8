"""Clocks are compared at the same moment, also where scans waited to be taken in."""

import pytest

from racecar.sensors.clocks.clock_offset import ClockOffset

SECOND = 1_000_000_000
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
