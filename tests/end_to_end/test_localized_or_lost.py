"""The verdict of ``racecar localize``: in its last line, its exit code and its report."""

import json
from pathlib import Path

import pytest

from tests.end_to_end.commands import Racecar


@pytest.mark.parametrize(
    ("map_name", "verdicts", "code", "seed"),
    [
        ("building", {"localized"}, 0, 0),
        ("track", {"uncertain", "lost"}, 3, 0),
        ("track", {"uncertain", "lost"}, 3, 1),
    ],
)
def test_a_drive_in_the_building_is_localized_there_and_not_on_the_race_track(
    racecar: Racecar,
    farther: Path,
    tmp_path: Path,
    map_name: str,
    verdicts: set[str],
    code: int,
    seed: int,
) -> None:
    """The track has a straight as wide as the corridor where the drive begins; the filter is sure of that."""
    done = racecar(
        *("localize", farther, "--map", map_name, "--out", tmp_path),
        *("--global", "--strict", "--seed", seed),
    )
    assert done.returncode == code, done.stderr
    quality = json.loads((tmp_path / "report.json").read_text())["quality"]
    assert quality["verdict"] in verdicts
    assert done.stdout.splitlines()[-1].startswith(f"The drive is {quality['verdict']}: ")
    assert quality["verdict"] != "localized" or quality["known_share"] > 0.9


@pytest.fixture(scope="module")
def farther(racecar: Racecar, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bag of twelve seconds: those of `drive` are too short to tell maps apart."""
    bag = tmp_path_factory.mktemp("farther") / "drive.bag"
    simulated = ("simulate", "--map", "building", "--noise", "slight", "--duration", "12", "--quiet")
    done = racecar(*simulated, "--seed", 3, "--out", bag)
    assert done.returncode == 0, done.stderr
    return bag


def test_only_the_bag_that_made_the_map_is_compared_with_its_trajectory(
    racecar: Racecar, drive: Path, mapped: Path, tmp_path: Path
) -> None:
    """A second simulated drive bears the same stamps, and its bag the same name."""
    simulated = ("simulate", "--map", "building", "--noise", "slight", "--duration", "3", "--quiet")
    assert racecar(*simulated, "--seed", 4, "--out", tmp_path / "drive.bag").returncode == 0
    compared = []
    for bag in (drive / "drive.bag", tmp_path / "drive.bag"):
        done = racecar("localize", bag, "--map", mapped, "--out", tmp_path / "out", "--quiet")
        assert done.returncode == 0, done.stderr
        report = json.loads((tmp_path / "out" / "report.json").read_text())
        compared.append("against_mapping_trajectory" in report["accuracy"])
    assert compared == [True, False]
