from dataclasses import replace

import numpy as np
import pytest

from racecar.sensors.scan import Scan
from racecar.sensors.self_calibration.scan_track import track_of
from racecar.sensors.self_calibration.sweep_order import SweepOrder, has_sweep_times, in_sweep_order
from tests.sensors.self_calibration.moving_laser import Laser, scans_of, straight_drive, winding_drive

SECONDS = 12.0


def order_of(scans: list[Scan]) -> SweepOrder:
    return in_sweep_order(track_of(scans)).order


def turned_round(scans: list[Scan]) -> list[Scan]:
    """As of a driver that turns the array of ranges round and leaves the times."""
    return [replace(scan, time_offsets=scan.time_offsets.max() - scan.time_offsets) for scan in scans]


@pytest.fixture(scope="module")
def scans() -> list[Scan]:
    return scans_of(winding_drive(SECONDS), SECONDS)


def test_beams_as_recorded(scans: list[Scan]) -> None:
    assert order_of(scans) == SweepOrder.AS_RECORDED


def test_beams_in_the_opposite_order(scans: list[Scan]) -> None:
    assert order_of(turned_round(scans)) == SweepOrder.REVERSED


def test_negative_times_are_as_good_as_positive_ones(scans: list[Scan]) -> None:
    negative = [
        replace(
            scan,
            stamp=scan.stamp + round(scan.time_offsets[-1] * 1e9),
            time_offsets=scan.time_offsets - scan.time_offsets[-1],
        )
        for scan in scans
    ]
    assert order_of(negative) == SweepOrder.AS_RECORDED
    assert (
        order_of([replace(scan, time_offsets=scan.time_offsets[::-1]) for scan in negative])
        == SweepOrder.REVERSED
    )


@pytest.mark.parametrize("turned", [False, True])
def test_without_turns_nothing_is_told(turned: bool) -> None:
    scans = scans_of(straight_drive(10.0), 10.0)
    assert order_of(turned_round(scans) if turned else scans) == SweepOrder.UNKNOWN


def test_a_fast_sweep_is_never_called_reversed() -> None:
    scans = scans_of(winding_drive(SECONDS), SECONDS, Laser(sweep=1e-4))
    assert order_of(scans) != SweepOrder.REVERSED


def test_equal_times_are_no_order(scans: list[Scan]) -> None:
    assert has_sweep_times(scans[0])
    assert not has_sweep_times(replace(scans[0], time_offsets=np.full(len(scans[0].ranges), 0.01)))
