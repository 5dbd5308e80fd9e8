"""The verdict of ``racecar localize``: in its last line, its exit code and its report."""

from pathlib import Path

import pytest

from tests.end_to_end.commands import Racecar, report_of, simulate


@pytest.mark.parametrize(
    ("map_name", "verdicts", "code", "seed"),
    [
        ("building", {"localized"}, 0, 0),
        ("track", {"uncertain", "lost"}, 3, 0),
        pytest.param("track", {"uncertain", "lost"}, 3, 1, marks=pytest.mark.slow),
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
        code=code,
    )
    quality = report_of(tmp_path)["quality"]
    assert quality["verdict"] in verdicts
    assert done.stdout.splitlines()[-1].startswith(f"The drive is {quality['verdict']}: ")
    assert quality["verdict"] != "localized" or quality["known_share"] > 0.9


@pytest.fixture(scope="module")
def farther(racecar: Racecar, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bag of twelve seconds: those of `drive` are too short to tell maps apart."""
    bag = tmp_path_factory.mktemp("farther") / "drive.bag"
    simulate(racecar, bag, 12, "--seed", 3)
    return bag


def test_only_the_bag_that_made_the_map_is_compared_with_its_trajectory(
    racecar: Racecar, drive: Path, mapped: Path, tmp_path: Path
) -> None:
    """A second simulated drive bears the same stamps, and its bag the same name."""
    simulate(racecar, tmp_path / "drive.bag", 3, "--seed", 4)
    compared = []
    for bag in (drive / "drive.bag", tmp_path / "drive.bag"):
        racecar("localize", bag, "--map", mapped, "--out", tmp_path / "out", "--quiet", "--replace")
        report = report_of(tmp_path / "out")
        compared.append("against_mapping_trajectory" in report["accuracy"])
    assert compared == [True, False]
