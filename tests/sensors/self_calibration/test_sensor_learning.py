"""What is wrong with the sensors is learned while the car drives, and put right from then on."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from racecar.maps.geometry.se2 import IDENTITY, compose
from racecar.sensors.findings import Finding
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.self_calibration.learned_corrections import KnownSensors
from racecar.sensors.self_calibration.sensor_learning import SensorLearning
from tests.sensors.drives import odometry_of, scans_of, winding_drive

SECONDS = 16.0
DRIVE = winding_drive(SECONDS)
BACKWARDS = np.array([-0.2, 0.0, np.pi])


def learn(
    scans: list[Scan], odometry: list[Odometry], *, moves_laser: bool = True
) -> tuple[SensorLearning, list[list[str]]]:
    told: list[list[str]] = []

    def tell(findings: Sequence[Finding]) -> None:
        told.append([finding.name for finding in findings])

    known = KnownSensors("/scan", "/odom", IDENTITY, "assumed identity")
    learning = SensorLearning(lambda: known, tell, moves_laser=moves_laser)
    items = sorted([*scans, *odometry], key=lambda item: item.stamp)
    for item in [*items, *items[-100:]]:
        if isinstance(item, Scan):
            learning.scan(item)
        else:
            learning.odometry(item)
    return learning, told


def test_sound_sensors_stay_as_they_are() -> None:
    scans, odometry = scans_of(DRIVE, SECONDS), odometry_of(DRIVE, SECONDS)
    learning, told = learn(scans, odometry)
    assert told == []
    assert learning.scan(scans[0]) is scans[0]
    assert learning.odometry(odometry[0]) is odometry[0]


def test_beams_in_the_opposite_order_of_time() -> None:
    scans = [
        replace(scan, bearings=-scan.bearings[::-1], ranges=scan.ranges[::-1])
        for scan in scans_of(DRIVE, SECONDS)
    ]
    factors = np.array([1.0, -1.0, -1.0])  # the same drive in a mirror
    odometry = [
        replace(sample, odom_from_base=sample.odom_from_base * factors)
        for sample in odometry_of(DRIVE, SECONDS)
    ]
    learning, told = learn(scans, odometry)
    assert told == [["beams_reversed"]]
    np.testing.assert_allclose(learning.scan(scans[0]).time_offsets, scans[0].time_offsets[::-1])


@pytest.mark.parametrize("moves_laser", [True, False])
def test_a_laser_that_looks_backwards(moves_laser: bool) -> None:
    scans, odometry = scans_of(compose(DRIVE, BACKWARDS), SECONDS), odometry_of(DRIVE, SECONDS)
    learning, told = learn(scans, odometry, moves_laser=moves_laser)
    assert told == [["place_learned", *([] if moves_laser else ["place_stays"])]]
    expected = BACKWARDS if moves_laser else IDENTITY
    np.testing.assert_allclose(learning.scan(scans[0]).base_from_laser, expected, atol=0.05)
