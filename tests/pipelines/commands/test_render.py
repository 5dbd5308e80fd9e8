"""``racecar render``: a run drawn again is a run of its own, whose files lie in one frame."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml

from racecar.maps.geometry.se2 import between, compose
from racecar.maps.map_files import load_map
from racecar.pipelines.commands.cli import run
from racecar.pipelines.files.session_file import load_session
from racecar.pipelines.files.tum import load_tum
from racecar.pipelines.runs import map_cautions, map_run

BYTES_OF_A_MAP = ("map.pgm", "map.yaml", "pose_graph.g2o", "session.npz")


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a bag of a lap's quarter, and of its map in ``map``."""
    folder = tmp_path_factory.mktemp("drive")
    bag = folder / "drive.bag"
    assert run(["simulate", "--map", "track", "--out", str(bag), "--duration", "8", "--quiet"]) == 0
    assert run(["map", str(bag), "--out", str(folder / "map"), "--quiet"]) == 0
    return folder


def render(drive: Path, out: Path, *options: str) -> int:
    return run(["render", str(drive / "map"), "--out", str(out), "--quiet", *options])


def test_with_the_same_settings_the_same_bytes_come_out(drive: Path, tmp_path: Path) -> None:
    assert render(drive, tmp_path) == 0
    for name in BYTES_OF_A_MAP:
        assert (tmp_path / name).read_bytes() == (drive / "map" / name).read_bytes(), name
    # The angles pass through text, whose last digit may turn out otherwise.
    before, after = load_tum(drive / "map/trajectory.tum"), load_tum(tmp_path / "trajectory.tum")
    np.testing.assert_array_equal(after.stamps, before.stamps)
    np.testing.assert_allclose(after.map_from_base, before.map_from_base, atol=1e-11)
    assert (tmp_path / "map.png").stat().st_size > 10_000


def test_a_map_too_large_to_be_read_is_written_and_what_would_read_it_left_out(
    drive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (map_run, map_cautions):
        monkeypatch.setattr(module, "MOST_PIXELS", 10_000)
    assert render(drive, tmp_path, "--svg", "--dxf", "--png", "--origin", "corner") == 0
    (warning,) = json.loads((tmp_path / "report.json").read_text())["warnings"]
    assert "too many to localize on it" in warning
    resolution = re.search(r"cells of ([0-9.]+) m", warning)
    assert resolution is not None
    assert not {"walls.svg", "walls.dxf"} & {path.name for path in tmp_path.iterdir()}
    assert (tmp_path / "map_image.png").exists()
    coarser = tmp_path / "coarser"
    assert render(drive, coarser, "--svg", "--resolution", resolution[1]) == 0
    assert 4_000 < load_map(coarser).cells.size <= 10_000
    assert (coarser / "walls.svg").exists()


def test_all_files_of_a_turned_map_lie_in_one_frame(drive: Path, tmp_path: Path) -> None:
    assert render(drive, tmp_path, "--turn", "0.4", "--origin", "corner", "--resolution", "0.1") == 0
    before, after = load_tum(drive / "map/trajectory.tum"), load_tum(tmp_path / "trajectory.tum")
    told = json.loads((tmp_path / "report.json").read_text())["result"]["frame_of_source"]
    frame = np.array([told["x_m"], told["y_m"], told["yaw_rad"]])
    assert frame[2] == 0.4
    np.testing.assert_allclose(after.map_from_base, compose(frame, before.map_from_base), atol=1e-8)
    session = load_session(tmp_path)
    grid = load_map(tmp_path)
    np.testing.assert_allclose(grid.map_from_grid, 0.0, atol=1e-12)
    assert grid.resolution == 0.1
    rows, columns = grid.cell_of(session.points).T
    assert np.mean(grid.cells[rows, columns] == 100) > 0.9
    vertices = [line.split() for line in (tmp_path / "pose_graph.g2o").read_text().splitlines()]
    first = next(np.array(words[2:5], dtype=float) for words in vertices if words[:2] == ["VERTEX_SE2", "0"])
    np.testing.assert_allclose(first, session.map_from_base[0], atol=1e-4)


def test_a_turned_and_cropped_map_localizes_its_bag(drive: Path, tmp_path: Path) -> None:
    assert render(drive, tmp_path / "straight", "--turn", "walls", "--crop", "driven") == 0
    arguments = ["localize", str(drive / "drive.bag"), "--map", str(tmp_path / "straight")]
    assert run([*arguments, "--out", str(tmp_path / "localized"), "--quiet"]) == 0
    mapped = load_tum(tmp_path / "straight/trajectory.tum")
    localized = load_tum(tmp_path / "localized/trajectory.tum")
    off = between(mapped.poses_at(localized.stamps), localized.map_from_base)
    assert np.hypot(off[:, 0], off[:, 1]).mean() < 0.05


def test_a_rendered_map_is_carried_on_in_its_frame(drive: Path, tmp_path: Path) -> None:
    straight, both = tmp_path / "straight", tmp_path / "both"
    assert render(drive, straight, "--turn", "0.4") == 0
    (tmp_path / "turn.yaml").write_text("mapping: {rendering: {turn: walls, crop: driven}}")
    arguments = ["map", str(drive / "drive.bag"), "--continue", str(straight), "--out", str(both)]
    assert run([*arguments, "--config", str(tmp_path / "turn.yaml"), "--quiet"]) == 0
    here, there = load_tum(straight / "trajectory.tum"), load_tum(both / "trajectory.tum")
    np.testing.assert_allclose(here.map_from_base[:, :2], there.map_from_base[:, :2], atol=0.1)
    warnings = json.loads((both / "report.json").read_text())["warnings"]
    assert any("carried on in the frame" in sentence for sentence in warnings)
    assert any("straight is of this recording already" in sentence for sentence in warnings)


def test_map_takes_the_same_settings(drive: Path, tmp_path: Path) -> None:
    (tmp_path / "drawn.yaml").write_text(
        "mapping: {resolution: 0.1, rendering: {turn: 0.4, origin: corner, crop: driven, left_out: [[2, 3]]}}"
    )
    arguments = ["map", str(drive / "drive.bag"), "--out", str(tmp_path / "mapped"), "--quiet", "--dxf"]
    assert run([*arguments, "--config", str(tmp_path / "drawn.yaml")]) == 0
    flags = ["--resolution", "0.1", "--turn", "0.4", "--origin", "corner", "--crop", "driven"]
    assert render(drive, tmp_path / "rendered", *flags, "--leave-out", "2 3", "--dxf") == 0
    mapped, rendered = load_map(tmp_path / "mapped"), load_map(tmp_path / "rendered")
    np.testing.assert_array_equal(mapped.cells, rendered.cells)
    np.testing.assert_array_equal(mapped.map_from_grid, rendered.map_from_grid)
    here, there = (load_tum(tmp_path / name / "trajectory.tum") for name in ("mapped", "rendered"))
    np.testing.assert_allclose(here.map_from_base, there.map_from_base, atol=1e-8)
    assert (tmp_path / "mapped/walls.dxf").exists()


def test_every_kind_of_file_is_written(drive: Path, tmp_path: Path) -> None:
    assert render(drive, tmp_path, "--png", "--svg", "--dxf", "--mode", "scale", "--occupied", "0.8") == 0
    for name in ("map_image.png", "walls.svg", "walls.dxf"):
        assert (tmp_path / name).stat().st_size > 0
    graded = load_map(tmp_path).cells
    assert np.any((graded > 20) & (graded < 80))


def test_without_its_trajectory_a_run_is_rendered_and_that_is_told(drive: Path, tmp_path: Path) -> None:
    alone = tmp_path / "alone" / "map"
    alone.mkdir(parents=True)
    shutil.copy(drive / "map/session.npz", alone)
    assert render(alone.parent, tmp_path / "out") == 0
    assert (tmp_path / "out/map.pgm").read_bytes() == (drive / "map/map.pgm").read_bytes()
    assert not (tmp_path / "out/trajectory.tum").exists()
    warnings = json.loads((tmp_path / "out/report.json").read_text())["warnings"]
    assert "trajectory.tum" in warnings[0]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--turn", "north"], "--turn cannot be used: it should be radians"),
        (["--crop", "1 2 3"], "--crop cannot be used: it should be a box"),
        (["--crop", "90 90 95 95"], "Nothing was seen in the box"),
        (["--origin", "left"], "--origin cannot be used"),
        (["--leave-out", "9 3"], "--leave-out cannot be used"),
        (["--leave-out", "0 1000"], "hold all scans"),
        (["--mode", "colour"], "--mode cannot be used"),
        (["--free", "0.9"], "--free or --occupied cannot be used"),
        (["--resolution", "50"], "--resolution cannot be used"),
    ],
)
def test_a_mistake_is_one_sentence(
    drive: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], words: str
) -> None:
    capsys.readouterr()
    assert render(drive, tmp_path / "out", *options) == 2
    told = capsys.readouterr().err
    assert words in told
    assert told.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_folder_without_a_session_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["render", str(tmp_path), "--out", str(tmp_path / "out")]) == 2
    assert "There is no session.npz" in capsys.readouterr().err


EDITS = """# what people know better
- unknown: [[3, -0.5], [4, -0.5], [4, 0.5], [3, 0.5]]
- keepout: [[1, -0.5], [2, -0.5], [2, 0.5], [1, 0.5]]
- speed: [[2, -0.5], [3, -0.5], [3, 0.5], [2, 0.5]]
  limit: 0.5
"""


def with_edits(drive: Path, folder: Path) -> Path:
    """A copy of the run, with edits beside its map."""
    shutil.copytree(drive / "map", folder / "map")
    (folder / "map/edits.yaml").write_text(EDITS)
    return folder


def value_at(folder: Path, name: str, x: float, y: float) -> int:
    grid = load_map(folder / name)
    row, column = grid.cell_of([[x, y]])[0]
    return int(grid.cells[row, column])


def test_edits_beside_the_map_are_drawn_and_go_along(drive: Path, tmp_path: Path) -> None:
    source, out = with_edits(drive, tmp_path), tmp_path / "out"
    assert render(source, out) == 0
    assert value_at(out, "map.yaml", 3.5, 0.0) == -1
    assert value_at(drive / "map", "map.yaml", 3.5, 0.0) == 0
    assert (out / "edits.yaml").read_text() == EDITS
    assert value_at(out, "keepout_mask.yaml", 1.5, 0.0) == 100
    assert value_at(out, "keepout_mask.yaml", 2.5, 0.0) == 0
    nodes = yaml.safe_load((out / "speed_filter.yaml").read_text())
    filter_info = nodes["speed_costmap_filter_info_server"]["ros__parameters"]
    assert filter_info["type"] == 2
    assert filter_info["multiplier"] * value_at(out, "speed_mask.yaml", 2.5, 0.0) == pytest.approx(0.5)
    assert value_at(out, "speed_mask.yaml", 1.5, 0.0) == 0
    assert load_map(out / "speed_mask.yaml").cells.shape == load_map(out).cells.shape


def test_edits_turn_with_the_map_and_are_drawn_again_from_there(drive: Path, tmp_path: Path) -> None:
    source, out = with_edits(drive, tmp_path), tmp_path / "out"
    assert render(source, out, "--turn", "0.4", "--origin", "-3 1") == 0
    told = json.loads((out / "report.json").read_text())["result"]["frame_of_source"]
    x, y, _ = compose([told["x_m"], told["y_m"], told["yaw_rad"]], [1.5, 0.0, 0.0])
    assert value_at(out, "keepout_mask.yaml", x, y) == 100
    assert render(source, out, "--turn", "0.6", "--replace") == 0
    assert not list(out.glob("*.kept*"))  # what was written by us is replaced
    assert run(["render", str(out), "--out", str(tmp_path / "again"), "--quiet"]) == 0
    assert (tmp_path / "again/map.pgm").read_bytes() == (out / "map.pgm").read_bytes()


def test_no_edits_of_people_are_lost(drive: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, out = with_edits(drive, tmp_path), tmp_path / "out"
    out.mkdir()
    (out / "edits.yaml").write_text("- wall: [[0, 0], [1, 1]]\n")
    assert render(source, out) == 2
    assert "holds other edits" in capsys.readouterr().err
    assert (out / "edits.yaml").read_text() == "- wall: [[0, 0], [1, 1]]\n"
    assert render(drive, tmp_path / "copy", "--edits", str(out / "edits.yaml")) == 0
    assert value_at(tmp_path / "copy", "map.yaml", 0.5, 0.5) == 100


def test_masks_of_edits_that_are_gone_go_too(drive: Path, tmp_path: Path) -> None:
    source = with_edits(drive, tmp_path)
    assert render(source, source / "map") == 0
    assert (source / "map/keepout_mask.yaml").exists()
    (source / "map/edits.yaml").write_text("- free: [[50, 50], [51, 50], [51, 51]]\n")
    assert render(source, source / "map") == 0
    assert not (source / "map/keepout_mask.yaml").exists()
    assert value_at(source / "map", "map.yaml", 3.5, 0.0) == 0
    warnings = json.loads((source / "map/report.json").read_text())["warnings"]
    assert "Edit 1, free, lies outside the map" in warnings[0]


def test_a_drive_that_carries_on_keeps_the_edits_and_one_that_does_not_tells(
    drive: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source, both = with_edits(drive, tmp_path), tmp_path / "both"
    arguments = ["map", str(drive / "drive.bag"), "--quiet", "--out"]
    assert run([*arguments, str(both), "--continue", str(source / "map")]) == 0
    assert (both / "edits.yaml").read_text() == EDITS
    assert value_at(both, "map.yaml", 3.5, 0.0) == -1
    assert run([*arguments, str(both)]) == 2
    assert "its keepout mask and its speed mask, which would be replaced" in capsys.readouterr().err
    assert run([*arguments, str(both), "--replace"]) == 0
    assert value_at(both, "map.yaml", 3.5, 0.0) == 0
    assert not (both / "keepout_mask.yaml").exists()
    assert "was not applied" in json.loads((both / "report.json").read_text())["warnings"][0]
