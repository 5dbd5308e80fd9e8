"""Scans that repeat the one before, and samples of odometry that are elsewhere."""

from pathlib import Path

import numpy as np
import pytest

from racecar.pipelines.bags.check import check_bag
from racecar.pipelines.bags.reader import BagReader
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.pipelines.bag_samples import read, write_bag


def noise(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(2.0, 9.0, 181).astype(np.float32)


def bag(path: Path, seen: list[int], driven: list[float]) -> Path:
    """At 40 Hz: the number of what is seen, and the metres that were driven."""

    return write_bag(
        path / "drive.bag",
        len(seen),
        place=None,
        wheels=lambda index: {"odom_from_base": np.array([driven[index], 0.0, 0.0])},
        scans=lambda index: {"ranges": noise(seen[index])},
    )


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
    def blank(index):
        return {"ranges": np.full(181, np.inf if index else 2.0, dtype=np.float32)}

    with BagReader(write_bag(tmp_path / "drive.bag", place=None, scans=blank)) as reader:
        assert check_bag(reader).counts["scans"] == 200


def test_without_odometry_nothing_says_that_the_car_moves(tmp_path):
    path = write_bag(tmp_path / "drive.bag", 100, with_odometry=False, scans=lambda _: {"ranges": noise(0)})
    assert len(read(path)[0]) == 100


def findings_and_path(path, away):
    """Of a drive of 200 samples with an offset (3,) of each."""

    def elsewhere(index):
        return {"odom_from_base": np.array([0.02 * index, 0.0, 0.0]) + away(index)}

    with BagReader(write_bag(path / "drive.bag", wheels=elsewhere)) as reader:
        poses = [item.odom_from_base for item in reader if isinstance(item, Odometry)]
        assert check_bag(reader).counts["odometry"] == len(poses)
        return [(each.name, each.numbers.get("times")) for each in reader.findings], np.array(poses)


@pytest.mark.parametrize("offset", [(3.0, 0.0, 0.0), (0.0, 0.0, 1.2)])
def test_single_samples_are_left_out(tmp_path, offset):
    (what,), poses = findings_and_path(tmp_path, lambda index: np.array(offset) * (index % 40 == 20))
    assert what == ("odometry_spikes", "5 times")
    np.testing.assert_allclose(np.ptp(poses, axis=0), [0.02 * 199, 0.0, 0.0], atol=1e-9)
    assert len(poses) == 195


def test_two_publishers_are_named_and_the_first_is_followed(tmp_path):
    (what,), poses = findings_and_path(tmp_path, lambda index: np.array([5.0, -3.0, 1.0]) * (index % 3 == 2))
    assert what[0] == "odometry_of_two_programs"
    assert np.ptp(poses[:, 1]) == 0.0


def test_odometry_that_begins_anew_is_no_spike(tmp_path):
    (what,), poses = findings_and_path(tmp_path, lambda index: np.array([50.0, 0.0, 0.0]) * (index > 90))
    assert what == ("odometry_jumps", "once")
    assert len(poses) == 199


def test_an_orientation_that_is_not_a_number_is_not_called_still(tmp_path):
    def without_heading(index):
        return {"odom_from_base": np.array([0.02 * index, 0.0, np.nan])}

    with BagReader(write_bag(tmp_path / "drive.bag", 60, wheels=without_heading)) as reader:
        items = [item for item in reader if isinstance(item, Odometry)]
        (name,) = [finding.name for finding in reader.findings]
    assert name == "odometry_without_orientation"
    assert items[-1].odom_from_base[0] == pytest.approx(0.8 * 59 * 0.025, abs=0.01)
