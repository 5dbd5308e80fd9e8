"""Gaps between scans: long ones, and shorter ones in which the car drove."""

import numpy as np
import pytest

from racecar.maps.geometry.se2 import IDENTITY
from racecar.pipelines.bags.facts import OdometryFacts
from racecar.pipelines.bags.scan_gaps import ScanGaps
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

SECOND = 10**9


def gaps_of(gap: float, speed: float, *, every: float = 0.1, jump: float = 0.0, count: int = 1) -> ScanGaps:
    """Of a car that drives at a speed through gaps that begin every 20 s; its odometry jumps once."""
    gaps, odometry = ScanGaps(), OdometryFacts()
    next_scan = 0.0
    for k in range(round(20 * (count + 1) / 0.05)):
        time = 0.05 * k
        place = speed * time + (jump if time > 21.0 else 0.0)
        odometry.add(Odometry(round(time * SECOND), np.array([place, 0.0, 0.0]), IDENTITY))
        is_in_gap = time >= 20.0 and time % 20.0 < gap - 1e-6
        if time >= next_scan - 1e-6 and not is_in_gap:
            scan = Scan(round(time * SECOND), np.zeros(1), np.ones(1), np.zeros(1), IDENTITY, 10.0)
            gaps.add(scan, odometry.path_length)
            next_scan = time + every
    return gaps


@pytest.mark.parametrize(
    ("seconds", "speed", "gap", "was_driven"),
    [
        (4.0, 2.0, "a gap of 4 s after scan 200, in which the wheels drove 8.2 m", True),
        (15.0, 0.0, "a gap of 15 s after scan 200", False),
    ],
)
def test_a_gap_in_which_the_wheels_drove_is_reported_and_a_long_one_anyhow(
    seconds: float, speed: float, gap: str, was_driven: bool
) -> None:
    (finding,) = gaps_of(seconds, speed).findings
    assert finding.numbers == {"gaps": gap, "more": 0, "was_driven": was_driven}


@pytest.mark.parametrize(
    ("gap", "speed", "every", "jump"),
    [
        (4.0, 0.0, 0.1, 0.0),
        (4.0, 0.3, 0.1, 0.0),
        (0.6, 4.0, 0.1, 0.0),
        (2.0, 2.0, 2.0, 0.0),
        (4.0, 0.0, 0.1, 50.0),
    ],
)
def test_others_are_not(gap: float, speed: float, every: float, jump: float) -> None:
    assert not gaps_of(gap, speed, every=every, jump=jump).findings


def test_many_are_counted() -> None:
    gaps = gaps_of(4.0, 2.0, count=8)
    assert gaps.count == 8
    assert gaps.findings[0].numbers["more"] == 3
