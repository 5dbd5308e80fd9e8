"""Scans that repeat the one before while the odometry moves."""

from pathlib import Path

import numpy as np
import pytest

from racecar.pipelines.bags.check import check_bag
from racecar.pipelines.bags.reader import BagReader
from racecar.sensors.scan import Scan
from tests.pipelines.bag_samples import bag_of, odometry, read, write_scan


def noise(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(2.0, 9.0, 181).astype(np.float32)


def bag(path: Path, seen: list[int], driven: list[float]) -> Path:
    """At 40 Hz: the number of what is seen, and the metres that were driven."""

    def write(writer):
        for index, (scan, metres) in enumerate(zip(seen, driven, strict=True)):
            writer.write_odometry(odometry(index, odom_from_base=np.array([metres, 0.0, 0.0])))
            write_scan(writer, index, ranges=noise(scan))

    return bag_of(path / "drive.bag", write)


def kept_and_findings(path: Path) -> tuple[int, list]:
    with BagReader(path) as reader:
        kept = sum(isinstance(item, Scan) for item in reader)
        findings = [each for each in reader.findings if each.name == "scans_repeated"]
    return kept, findings


@pytest.mark.parametrize(("frozen", "spoils"), [(60, False), (180, True)])
def test_scans_that_stand_still_while_the_car_moves_are_left_out(tmp_path, frozen, spoils):
    seen = [min(index, 20) if index < 20 + frozen else index for index in range(220)]
    kept, findings = kept_and_findings(bag(tmp_path, seen, [0.025 * index for index in range(220)]))
    assert kept == 220 - (frozen - 1)
    (finding,) = findings
    assert finding.numbers["count"] == frozen - 1
    assert finding.numbers["first"] == pytest.approx(0.5, abs=0.05)
    assert finding.spoils_map is spoils


def test_each_scan_sent_twice_counts_once(tmp_path):
    seen = [index // 2 for index in range(200)]
    kept, findings = kept_and_findings(bag(tmp_path, seen, [0.03 * index for index in range(200)]))
    assert 100 <= kept <= 102  # where the odometry begins and ends
    assert findings == []  # as some Neatos do, and nothing is lost


@pytest.mark.parametrize("late", [0, 10])
def test_a_simulated_car_may_stand_without_noise(tmp_path, late):
    """Also where the odometry comes late, and creeps meanwhile."""
    places = [0.03 * min(index % 200, 100) + 3.0 * (index // 200) for index in range(400)]
    creeps = [place + 1e-5 * index for index, place in enumerate([0.0] * late + places)]
    seen = [round(place * 100) for place in places]
    kept, findings = kept_and_findings(bag(tmp_path, seen, creeps[:400]))
    assert findings == []
    assert kept >= 380 if late == 0 else kept > 280


def test_blank_scans_are_no_repeats(tmp_path):
    def write(writer):
        for index in range(200):
            writer.write_odometry(odometry(index))
            write_scan(writer, index, ranges=np.full(181, np.inf if index else 2.0, dtype=np.float32))

    with BagReader(bag_of(tmp_path / "drive.bag", write)) as reader:
        assert check_bag(reader).counts["scans"] == 200


def test_without_odometry_nothing_says_that_the_car_moves(tmp_path):
    def write(writer):
        for index in range(100):
            write_scan(writer, index, ranges=noise(0))

    assert len(read(bag_of(tmp_path / "drive.bag", write))[0]) == 100
