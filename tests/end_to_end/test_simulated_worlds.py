"""What each flag of ``racecar simulate`` puts into a bag, and that the bag stays one to be mapped."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.files.tum import load_tum
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.end_to_end.commands import Racecar

Recorded = tuple[list[Scan], list[Odometry], NDArray[np.float64]]
"""Scans, odometry and the true poses (N, 3) at the scans."""
Drive = Callable[..., Recorded]


@pytest.fixture
def drive(racecar: Racecar, tmp_path: Path) -> Drive:
    """Simulate a short drive with some flags and read what it left."""

    def simulate(*flags: object, map: str = "track", seconds: float = 6.0) -> Recorded:
        bag = tmp_path / "drive.bag"
        racecar("simulate", "--map", map, "--out", bag, "--duration", seconds, "--quiet", *flags)
        with BagReader(bag) as reader:
            messages = list(reader)
        scans = [message for message in messages if isinstance(message, Scan)]
        truth = load_tum(tmp_path / "drive.ground_truth.tum")
        assert [scan.stamp for scan in scans] == truth.stamps.tolist()
        odometry = [message for message in messages if isinstance(message, Odometry)]
        assert len(odometry) == pytest.approx(50 * seconds, abs=3)
        return scans, odometry, truth.map_from_base

    return simulate


def ranges_of(scans: list[Scan]) -> NDArray[np.float64]:
    """(N, beams)"""
    return np.array([scan.ranges for scan in scans])


@pytest.mark.parametrize(
    ("laser", "beams", "degrees", "metres", "rate"),
    [
        ("race", 1081, 270, 30.0, 40),
        ("short", 683, 240, 4.0, 10),
        ("round", 360, 359, 12.0, 7),
        ("outdoor", 361, 180, 80.0, 10),
    ],
)
def test_lasers(drive: Drive, laser: str, beams: int, degrees: int, metres: float, rate: int) -> None:
    scans, _, _ = drive("--laser", laser)
    assert len(scans) == pytest.approx(6 * rate, abs=2)
    bearings = scans[0].bearings
    assert len(bearings) == beams
    assert np.degrees(bearings[-1] - bearings[0]) == pytest.approx(degrees, abs=0.01)
    assert scans[0].max_range == metres
    share = np.isfinite(ranges_of(scans)).mean()
    assert (0.25 < share < 0.5) if laser == "short" else (share > 0.9)


def test_a_tilted_laser_sees_the_floor_at_nearly_the_same_range(drive: Drive) -> None:
    level, tilted = (ranges_of(drive("--tilt", tilt)[0])[:, 540] for tilt in (0, 4))
    arc = 0.15 / np.sin(np.radians(4.0))
    assert np.all(tilted[np.isfinite(tilted)] < arc + 0.5)
    is_floor = level > arc + 0.5
    assert is_floor.mean() > 0.5
    assert np.nanstd(tilted[is_floor & np.isfinite(tilted)]) < 0.15


def test_on_hills_a_level_laser_sees_the_ground_at_times(drive: Drive) -> None:
    flat, hilly = (ranges_of(drive("--hills", grade)[0]) for grade in (0.0, 0.15))
    ground = (np.nan_to_num(flat, posinf=40.0) - np.nan_to_num(hilly, posinf=40.0) > 0.5).mean(axis=1)
    assert ground.max() > 0.05
    assert ground.min() < 0.01


@pytest.mark.slow
def test_on_a_campus_the_ground_comes_and_goes(drive: Drive) -> None:
    flags = ("--laser", "outdoor", "--speed", 4, "--noise", "none")
    flat, hilly = (
        ranges_of(drive(*flags, *hills, map="campus", seconds=40)[0])
        for hills in ([], ["--hills", 0.05, "--tilt", 0.5, "--kerbs", 0.15])
    )
    ground = (np.nan_to_num(flat, posinf=200.0) - np.nan_to_num(hilly, posinf=200.0) > 2.0).mean(axis=1)
    assert np.count_nonzero(ground > 0.3) > 20
    assert np.count_nonzero(ground < 0.1) > 20
    returns = np.isfinite(flat).sum(axis=1)
    assert returns.min() < 60 and returns.max() > 200


@pytest.mark.parametrize("seconds", [1.0, 2.5])
def test_a_slow_logger(drive: Drive, seconds: float) -> None:
    scans, _, _ = drive("--every", seconds)
    np.testing.assert_allclose(np.diff([scan.stamp for scan in scans]) * 1e-9, seconds, atol=1e-6)


def test_gaps_between_scans(drive: Drive) -> None:
    scans, _, _ = drive("--scan-gaps", 3, seconds=17.0)
    pauses = np.diff([scan.stamp for scan in scans]) * 1e-9
    assert pauses.max() == pytest.approx(3.025, abs=0.03)
    assert np.count_nonzero(pauses > 0.1) == 1


def test_own_posts_are_in_every_scan_at_the_same_place(drive: Drive) -> None:
    ranges = ranges_of(drive("--posts", 3)[0])
    always_near = np.nanmax(np.where(np.isfinite(ranges), ranges, np.nan), axis=0) < 0.45
    assert 0.01 < always_near.mean() < 0.2
    assert ranges[:, ~always_near].min() > 0.15


def test_a_carried_car_moves_while_its_wheels_stand(drive: Drive) -> None:
    scans, odometry, truth = drive("--carried", 12, "--carrier", "--noise", "none", seconds=26.0)
    times = np.array([scan.stamp for scan in scans]) * 1e-9
    carried = times - times[0] > 18.1
    moved = np.hypot(*np.diff(truth[:, :2], axis=0).T).cumsum()
    assert moved[-1] - moved[carried[1:]][0] > 3.0
    last = odometry[int(50 * 18.2) :]
    assert np.ptp([sample.odom_from_base for sample in last], axis=0).max() == 0.0
    near = (ranges_of(scans) < 0.35).mean(axis=1)
    assert near[carried].min() > 0.45
    assert near[times - times[0] < 17.9].max() < 0.2


def test_a_follower_is_seen_behind_the_car_all_the_time(drive: Drive) -> None:
    alone, followed = (
        np.nan_to_num(ranges_of(drive("--laser", "round", *flags)[0]), posinf=50.0)
        for flags in ([], ["--follower"])
    )
    is_person = alone - followed > 0.2
    assert np.mean(is_person.any(axis=1)) > 0.8
    assert 1.5 < np.median(followed[is_person]) < 3.5


def test_odometry_by_steering_drifts_in_heading(drive: Drive) -> None:
    _, odometry, truth = drive("--steering", "--noise", "none")
    turned = np.unwrap([sample.odom_from_base[2] for sample in odometry])[-1]
    assert 2.0 < np.degrees(abs(turned - np.unwrap(truth[:, 2])[-1] + truth[0, 2])) < 45.0


def test_flags_may_be_combined(drive: Drive) -> None:
    scans, odometry, _ = drive(
        *("--laser", "short", "--every", 0.5, "--posts", 2, "--follower", "--tilt", 1, "--hills", 0.02),
        *("--carried", 3, "--carrier", "--steering", "--slip", 0.1, "--walkers", 2),
    )
    assert len(scans) == 12
    assert np.isfinite(ranges_of(scans)).mean() > 0.2
    assert np.hypot(*odometry[-1].odom_from_base[:2]) > 3.0
