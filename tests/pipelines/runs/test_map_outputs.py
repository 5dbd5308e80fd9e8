"""The files of a mapping run, and how one is added."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecar.mapping.grid.config import RenderingConfig
from racecar.mapping.state.result import MappingResult
from racecar.maps.errors import UserError
from racecar.maps.grid.tiled_grid import TiledGrid
from racecar.pipelines.commands.cli import run as run_command
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs import map_outputs, mapping_run
from racecar.pipelines.runs.map_outputs import MapOutputKind, outputs_with, remove_outdated
from racecar.pipelines.runs.map_run import MapRun


def write_title(run: MapRun, folder: Path) -> None:
    (folder / "title.txt").write_text(run.title)


def refuse() -> None:
    raise UserError("No.")


def test_an_output_is_one_entry_of_the_list(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    extra = MapOutputKind(
        ("extra.txt",), lambda run, folder: (folder / "extra.txt").touch(), only_on_request=True
    )
    monkeypatch.setattr(map_outputs, "MAP_OUTPUTS", (MapOutputKind(("title.txt",), write_title), extra))
    nothing: Any = None
    grid = TiledGrid({}, 1, 1, 0.05, np.zeros(3))
    run = MapRun(
        MappingResult(nothing, grid, RenderingConfig(), nothing, nothing), Report("racecar map"), "a drive"
    )
    run.write(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"title.txt", "report.json"}
    assert (tmp_path / "title.txt").read_text() == "a drive"
    run.write(tmp_path, requested=["extra.txt"])
    assert (tmp_path / "extra.txt").exists()


def test_what_an_output_needs_is_asked_for_only_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    needy = MapOutputKind(("needy.txt",), write_title, only_on_request=True, require=refuse)
    monkeypatch.setattr(map_outputs, "MAP_OUTPUTS", (needy,))
    assert outputs_with() == []
    with pytest.raises(UserError, match="No"):
        outputs_with(["needy.txt"])


def test_a_cloud_without_open3d_is_refused_before_the_bag_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    bag, out = tmp_path / "drive.bag", tmp_path / "out"
    arguments = ["--map", "track", "--out", str(bag), "--duration", "1", "--quiet"]
    assert run_command(["simulate", *arguments]) == 0
    monkeypatch.setitem(sys.modules, "open3d", None)
    monkeypatch.setattr(mapping_run, "build_map", lambda *_, **__: pytest.fail("mapped"))
    assert run_command(["map", str(bag), "--out", str(out), "--ply"]) == 2
    shown = capsys.readouterr().err
    assert shown.count("\n") == 1
    assert "open3d" in shown
    assert not out.exists()


def test_what_shows_a_map_goes_with_it_and_stays_while_it_is_the_same(tmp_path: Path) -> None:
    old, new = tmp_path / "run", tmp_path / "new"
    for folder in (old, new):
        folder.mkdir()
        for name in ("map.yaml", "map.pgm", "session.npz"):
            (folder / name).write_text("as it was")
    for name in ("walls.svg", "track.csv", "points.ply", "map_image.png", "notes.txt"):
        (old / name).touch()
    report = Report("racecar render")
    remove_outdated(old, new, report)
    assert report.warnings == []
    (new / "map.pgm").write_text("corrected")
    (new / "map_image.png").touch()
    remove_outdated(old, new, report)
    assert {path.name for path in new.glob(".wh.*")} == {".wh.walls.svg", ".wh.track.csv"}
    walls, track = report.warnings
    assert "walls.svg showed the earlier map and was removed; --svg makes it again" in walls
    assert "track.csv" in track
