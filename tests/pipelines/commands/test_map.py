"""What commands say at their end: the verdict on the map, and the files that they wrote."""

import json
from pathlib import Path

import numpy as np
import pytest

from racecar.mapping.quality.map_quality import DoubtfulSegment, MapQuality, Verdict
from racecar.pipelines.commands.cli import run
from racecar.pipelines.commands.results import where_to_look
from racecar.pipelines.files.outputs import output_folder
from tests.pipelines.bag_samples import write_bag

WRONG = MapQuality(
    Verdict.WRONG,
    1.5,
    4.0,
    ("Walls lie apart.",),
    (DoubtfulSegment("Here.", (0, 1), np.array([1.0, 2.0]), (0.0, 1.5)),),
    {"spread_local": float("nan")},
)


def map_a_bag(folder: Path, *options: str) -> int:
    return run(["map", str(write_bag(folder / "drive.bag")), "--out", str(folder / "out"), *options])


def test_the_last_line_is_the_verdict(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The wheels of the sample drive while its scans stay the same."""
    assert map_a_bag(tmp_path, "--strict") == 0
    last = capsys.readouterr().out.strip().splitlines()[-1]
    assert last.startswith("The map is doubtful: where walls hold, wheels and map differ by 93% of the way")
    assert json.loads((tmp_path / "out/report.json").read_text())["quality"]["verdict"] == "doubtful"


def test_a_wrong_map_is_written_and_told_and_strict_ends_in_3(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("racecar.mapping.mapper.judge", lambda *_: WRONG)
    assert map_a_bag(tmp_path) == 0
    last = capsys.readouterr().out.strip().splitlines()[-1]
    assert last.startswith("The map is wrong")
    assert last.endswith("Walls lie apart. Here.")
    assert map_a_bag(tmp_path, "--strict", "--quiet", "--replace") == 3
    told = json.loads((tmp_path / "out/report.json").read_text())["quality"]
    assert told["verdict"] == "wrong"
    assert told["statistics"] == {"spread_local": None}
    assert told["segments"][0]["to_s"] == 1.5
    assert (tmp_path / "out/map.png").exists()


def write(folder: Path, *names: str) -> None:
    with output_folder(folder) as staging:
        for name in names:
            (staging / name).write_text("a")


def test_each_file_is_named(tmp_path: Path) -> None:
    run = tmp_path / "run"
    assert where_to_look(run, "map.png") == f"Look at {run / 'map.png'}."
    write(run, "map.png", "walls.svg", "map.yaml")
    assert where_to_look(run, "map.png") == f"Look at {run / 'map.png'}; also in {run}: map.yaml, walls.svg."
    write(run, "map.png")
    assert where_to_look(run, "map.png") == f"Look at {run / 'map.png'}."


def test_many_files_are_counted_by_kind(tmp_path: Path) -> None:
    figures = [f"{number}.{kind}" for number in range(6) for kind in ("png", "svg")]
    write(tmp_path, *figures, "report.html", "report.json")
    said = where_to_look(tmp_path, "report.html")
    assert said.endswith(": 6 .png files, 6 .svg files, report.json.")


def test_the_figures_are_named_too(tmp_path: Path) -> None:
    said = where_to_look(tmp_path, "map.png", tmp_path / "figures.json")
    assert said.endswith(f"map.png. The figures are in {tmp_path / 'figures.json'}.")


@pytest.mark.parametrize("command", ["check", "map", "localize"])
def test_commands_name_the_file_of_json(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = write_bag(tmp_path / "drive.bag", 40)
    out = ["--out", str(tmp_path / "out")]
    arguments = {
        "check": [str(bag)],
        "map": [str(bag), *out],
        "localize": [str(bag), "--map", "building", *out, "--initial-pose", "0", "0", "0"],
    }[command]
    figures = tmp_path / "figures.json"
    assert run([command, *arguments, "--json", str(figures)]) == 0
    assert f"The figures are in {figures}." in capsys.readouterr().out
    assert figures.exists()
    assert run([command, *arguments, "--json", str(figures), "--quiet", "--replace"]) == 0
    assert capsys.readouterr().out == ""
