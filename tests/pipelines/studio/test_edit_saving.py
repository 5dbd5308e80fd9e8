"""Edits that are drawn go into the folder of their map, and the map is rendered with them."""

import shutil
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from racecar.mapping.config import MappingConfig
from racecar.maps.errors import UserError
from racecar.maps.grid.edits import Edit
from racecar.maps.map_files import load_map
from racecar.pipelines.commands.cli import run
from racecar.pipelines.files.edits_file import MapEdits, edits_beside
from racecar.pipelines.runs.output_places import OutputFolder, check_places
from racecar.pipelines.studio.edit.saving import Saving, as_the_map_lies

AREA = Edit("unknown", np.array([[1.0, -0.5], [2.0, -0.5], [2.0, 0.5], [1.0, 0.5]]))


@pytest.fixture(scope="module")
def mapped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of two seconds, with cells of 10 cm."""
    folder = tmp_path_factory.mktemp("drive")
    bag, config = folder / "drive.bag", folder / "coarse.yaml"
    config.write_text("mapping: {resolution: 0.1}")
    assert run(["simulate", "--map", "track", "--out", str(bag), "--duration", "2", "--quiet"]) == 0
    assert run(["map", str(bag), "--out", str(folder / "map"), "--config", str(config), "--quiet"]) == 0
    return folder / "map"


@pytest.fixture
def folder(mapped: Path, tmp_path: Path) -> Path:
    """A copy of that run."""
    shutil.copytree(mapped, tmp_path / "map")
    return tmp_path / "map"


def saving(folder: Path) -> Saving:
    return Saving(folder, as_the_map_lies(folder, MappingConfig()), edits_beside(folder))


def save(to: Saving, edits: MapEdits, out: Path, *, straight: bool = False, cropped: bool = False) -> str:
    return to.save(edits, out, check, is_straightened=straight, is_cropped=cropped)


def check(place: OutputFolder, read: Sequence[Path]) -> None:
    check_places([place], read, replace=False)


def value_at(map: Path, x: float, y: float) -> int:
    grid = load_map(map)
    row, column = grid.cell_of([[x, y]])[0]
    return int(grid.cells[row, column])


def test_a_map_keeps_its_frame_and_cells_and_gets_the_edits_and_loses_them_again(folder: Path) -> None:
    before, to = load_map(folder), saving(folder)
    edits = MapEdits().with_entry(AREA)
    words = save(to, edits, folder)
    assert f"1 edit in {folder / 'edits.yaml'}" in words
    assert "map.pgm" in words
    after = load_map(folder)
    assert after.resolution == before.resolution == 0.1
    np.testing.assert_array_equal(after.map_from_grid, before.map_from_grid)
    assert value_at(folder, 1.5, 0.0) == -1
    save(to, edits.without(edits.edits[0]), folder)
    np.testing.assert_array_equal(load_map(folder).cells, before.cells)
    assert edits_beside(folder).edits == ()


def test_a_straightened_map_goes_into_another_folder_and_its_edits_beside_it(folder: Path) -> None:
    out, to = folder.parent / "straight", saving(folder)
    edits = MapEdits().with_entry(AREA)
    with pytest.raises(UserError, match="name another folder"):
        save(to, edits, folder, straight=True)
    assert not to.is_saved(edits)
    save(to, edits, out, straight=True, cropped=True)
    assert to.is_saved(edits)
    assert len(edits_beside(folder).edits) == len(edits_beside(out).edits) == 1
    middle = edits_beside(out).edits[0].points.mean(axis=0)
    assert value_at(out, *middle.tolist()) == -1


def test_edits_of_another_hand_are_not_overwritten(folder: Path) -> None:
    to = saving(folder)
    theirs = "- wall: [[0, 0], [1, 1]]\n"
    (folder / "edits.yaml").write_text(theirs)
    with pytest.raises(UserError, match="was changed meanwhile"):
        save(to, MapEdits().with_entry(AREA), folder)
    assert (folder / "edits.yaml").read_text() == theirs


def test_where_no_map_can_be_written_the_edits_are_saved_all_the_same(folder: Path) -> None:
    to, edits = saving(folder), MapEdits().with_entry(AREA)
    with pytest.raises(UserError, match="is a file; name a folder"):
        save(to, edits, folder / "map.yaml")
    assert to.is_saved(edits)
    assert len(edits_beside(folder).edits) == 1


def test_a_folder_that_cannot_be_written_to_is_told(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> str:
        raise PermissionError(13, "Permission denied")

    to, edits = saving(folder), MapEdits().with_entry(AREA)
    monkeypatch.setattr("racecar.maps.whole_files.tempfile.mkdtemp", refuse)
    with pytest.raises(UserError, match="permission denied; choose another place"):
        save(to, edits, folder)
    assert not to.is_saved(edits)
