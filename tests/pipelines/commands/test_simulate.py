"""The command ``racecar simulate``."""

from inspect import signature
from pathlib import Path
from typing import get_type_hints

import numpy as np
import pytest

from racecar.maps.shipped import shipped_names
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.commands.cli import run
from racecar.pipelines.commands.simulate import simulate
from racecar.pipelines.files.tum import load_tum
from racecar.pipelines.simulation.laser_models import LASERS
from racecar.pipelines.simulation.simulator import ground_truth_file


def test_it_writes_a_bag_and_the_true_path_beside_it(tmp_path: Path) -> None:
    bag = tmp_path / "runs" / "drive.bag"
    assert run(["simulate", "--map", "track", "--out", str(bag), "--duration", "2", "--quiet"]) == 0
    assert sorted(path.name for path in bag.parent.iterdir()) == ["drive.bag", "drive.ground_truth.tum"]
    truth = load_tum(bag.parent / "drive.ground_truth.tum")
    with BagReader(bag, odom_topic="/odom") as reader:
        assert len(truth) == sum(1 for message in reader if hasattr(message, "ranges"))
    assert np.linalg.norm(truth.map_from_base[0, :2]) < 0.3


def test_two_drives_in_a_folder_keep_their_own_true_paths(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    truths = []
    for name, map_ in (("a.bag", "track"), ("b.c", "building")):
        bag = tmp_path / name
        assert run(["simulate", "--map", map_, "--out", str(bag), "--duration", "1"]) == 0
        truths.append(ground_truth_file(bag))
        shown = capsys.readouterr().out
        assert str(truths[-1]) in shown
        assert shown.count("\n") == 1
    assert [path.name for path in truths] == ["a.ground_truth.tum", "b.c.ground_truth.tum"]
    assert truths[0].read_text() != truths[1].read_text()


@pytest.mark.parametrize("name", ["twin_corridors", "bare_corridor"])
def test_it_knows_the_places_that_are_hard_to_map(tmp_path: Path, name: str) -> None:
    out = ["--out", str(tmp_path / "a.bag"), "--duration", "1", "--quiet"]
    assert run(["simulate", "--map", name, *out]) == 0


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--map", "nowhere"], "There is no map at nowhere"),
        (["--map", "track", "--duration", "-3"], "duration"),
        (["--map", "track", "--noise", "some"], "noise"),
    ],
)
def test_what_is_wrong_is_told_and_nothing_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], complaint: str
) -> None:
    assert run(["simulate", *arguments, "--out", str(tmp_path / "a.bag")]) == 2
    assert complaint in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_help_and_refusal_name_every_built_in_plan(capsys: pytest.CaptureFixture[str]) -> None:
    (option,) = get_type_hints(simulate, include_extras=True)["map"].__metadata__
    assert run(["simulate", "--map", "castle", "--out", "castle.bag"]) == 2
    refusal = capsys.readouterr().err
    for name in shipped_names():
        assert name in option.help
        assert name in refusal


def test_help_and_documentation_tell_what_each_laser_is() -> None:
    (option,) = signature(simulate).parameters["laser"].annotation.__metadata__
    page = (Path(__file__).parents[3] / "docs" / "how-to" / "simulate.md").read_text(encoding="utf-8")
    for kind, laser in LASERS.items():
        around, rate = round(laser.field_of_view, -1), round(1.0 / laser.scan_time)
        assert f"{kind.value}: {around:.0f}°, {laser.range_max:.0f} m, {rate} Hz" in option.help
        (row,) = [line for line in page.splitlines() if line.startswith(f"| `{kind.value}`")]
        assert f"| {laser.beams} | {around:.0f}° | {laser.range_max:.0f} m | {rate} |" in row
