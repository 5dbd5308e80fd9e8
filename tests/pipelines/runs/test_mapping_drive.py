"""Which bag made a map is what the report beside it says, and nothing else."""

import json
from pathlib import Path

import numpy as np
import pytest

from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.storage.folder import bag_fingerprint
from racecar.pipelines.files.tum import save_tum
from racecar.pipelines.runs.mapping_drive import MappingDrive


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """A bag, and the map in the folder ``map``, with the trajectory of a drive but no report."""
    (tmp_path / "map").mkdir()
    (tmp_path / "map" / "map.yaml").write_text("image: map.pgm")
    save_tum(Trajectory(np.array([10**9]), np.zeros((1, 3))), tmp_path / "map" / "trajectory.tum")
    (tmp_path / "drive.bag").write_bytes(b"#ROSBAG V2.0\n")
    return tmp_path / "drive.bag"


def is_known(bag: Path, report: str) -> bool:
    folder = bag.parent / "map"
    (folder / "report.json").write_text(report)
    drive = MappingDrive.beside(folder)
    assert drive is not None
    assert len(drive.trajectory()) == 1
    return drive.is_of(bag)


def test_it_is_known_by_path_and_better_by_content(bag: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(bag.parent)
    assert is_known(bag, json.dumps({"inputs": {"bag": "drive.bag"}}))
    fingerprint = bag_fingerprint(bag)
    assert is_known(bag, json.dumps({"inputs": {"bag": "moved.bag", "bag_fingerprint": fingerprint}}))
    bag.write_bytes(b"#ROSBAG V2.0\nanother drive")
    assert not is_known(bag, json.dumps({"inputs": {"bag": "drive.bag", "bag_fingerprint": fingerprint}}))


@pytest.mark.parametrize(
    "report",
    [
        *("", "{", "[]", "[" * 100_000),
        *('{"inputs": 3}', '{"inputs": {}}', '{"inputs": {"bag": 3}}', '{"inputs": {"bag": "other.bag"}}'),
    ],
)
def test_a_report_that_does_not_name_the_bag_names_none(bag: Path, report: str) -> None:
    assert not is_known(bag, report)


def test_a_map_without_a_drive_beside_it_has_none(bag: Path) -> None:
    (bag.parent / "map" / "trajectory.tum").unlink()
    assert MappingDrive.beside(bag.parent / "map") is None
