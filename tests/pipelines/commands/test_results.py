"""What commands say at their end of the files that they wrote."""

from pathlib import Path

import pytest

from racecar.pipelines.commands.cli import run
from racecar.pipelines.commands.results import where_to_look
from racecar.pipelines.files.outputs import output_folder
from tests.pipelines.bag_samples import write_bag


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
    assert run([command, *arguments, "--json", str(figures), "--quiet"]) == 0
    assert capsys.readouterr().out == ""
