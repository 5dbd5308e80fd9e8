from dataclasses import replace

import numpy as np
import pytest

from racecar.sensors.scan import Scan
from racecar.sensors.self_calibration.scan_track import track_of
from racecar.sensors.self_calibration.sweep_order import SweepOrder, has_sweep_times, in_sweep_order
from tests.sensors.drives import Laser, scans_of, straight_drive, winding_drive

SECONDS = 12.0


def order_of(scans: list[Scan], *, reverse: bool = False) -> SweepOrder:
    """Also as of a driver that turns the array of ranges round and leaves the times."""
    if reverse:
        scans = [replace(scan, time_offsets=scan.time_offsets[::-1]) for scan in scans]
    return in_sweep_order(track_of(scans)).order


@pytest.fixture(scope="module")
def scans() -> list[Scan]:
    return scans_of(winding_drive(SECONDS), SECONDS)


def ending_at_stamps(scans: list[Scan]) -> list[Scan]:
    """With negative times."""
    return [
        replace(scan, stamp=scan.stamp + round(last * 1e9), time_offsets=scan.time_offsets - last)
        for scan in scans
        for last in scan.time_offsets[-1:]
    ]


@pytest.mark.parametrize("negative", [False, True])
@pytest.mark.parametrize(("reverse", "order"), [(False, SweepOrder.AS_RECORDED), (True, SweepOrder.REVERSED)])
def test_the_order_of_beams_shows_in_turns(
    scans: list[Scan], negative: bool, reverse: bool, order: SweepOrder
) -> None:
    assert order_of(ending_at_stamps(scans) if negative else scans, reverse=reverse) == order


@pytest.mark.parametrize("reverse", [False, True])
def test_without_turns_nothing_is_known(reverse: bool) -> None:
    assert order_of(scans_of(straight_drive(10.0), 10.0), reverse=reverse) == SweepOrder.UNKNOWN


def test_a_fast_sweep_is_never_called_reversed() -> None:
    scans = scans_of(winding_drive(SECONDS), SECONDS, Laser(sweep=1e-4))
    assert order_of(scans) != SweepOrder.REVERSED


def test_equal_times_are_no_order(scans: list[Scan]) -> None:
    assert has_sweep_times(scans[0])
    assert not has_sweep_times(replace(scans[0], time_offsets=np.full(len(scans[0].ranges), 0.01)))
