"""What commands say at their end of the files that they wrote."""

from pathlib import Path

from racecar.pipelines.commands.written_files import where_to_look
from racecar.pipelines.files.outputs import output_folder


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
