"""What the package offers at its top, to those who write ``import racecar``."""

import json
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest
from matplotlib import pyplot

import racecar
from racecar.maps.errors import UserError
from racecar.pipelines.bags.writer import BagWriter
from racecar.pipelines.commands.cli import run
from tests.pipelines.bag_samples import write_bag

WRITTEN = ("map.pgm", "map.yaml", "map.png", "trajectory.tum", "pose_graph.g2o", "session.npz")


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_bag(tmp_path_factory.mktemp("bag") / "drive.bag", 60)


@pytest.fixture(scope="module")
def mapped(bag: Path) -> racecar.MapRun:
    return racecar.map_bag(str(bag))


def test_the_version_is_that_of_the_package() -> None:
    assert racecar.__version__ == version("racecar-slam")
    with pytest.raises(AttributeError):
        racecar.no_such_name  # type: ignore[attr-defined]  # noqa: B018


def test_paths_may_be_plain_strings(tmp_path: Path) -> None:
    with BagWriter(str(tmp_path / "drive.bag")) as writer:
        for k in range(3):
            ranges = np.full(180, 2.0, dtype=np.float32)
            writer.write_scan(k * 25_000_000, ranges, -1.5, 0.017, 0.0, 0.025, 0.1, 10.0)
    with racecar.BagReader(str(tmp_path / "drive.bag")) as reader:
        assert sum(isinstance(message, racecar.Scan) for message in reader) == 3
    grid = racecar.load_map("track")
    racecar.save_map(grid, str(tmp_path / "map.yaml"))
    assert np.array_equal(racecar.load_map(str(tmp_path)).cells, grid.cells)


def test_the_import_loads_nothing() -> None:
    code = (
        "import sys; before = set(sys.modules); import racecar; dir(racecar); "
        "heavy = {'numpy', 'numba', 'gtsam', 'matplotlib', 'rosbags', 'scipy', 'pydantic', 'typer'}; "
        "sys.exit(bool(heavy & (set(sys.modules) - before)))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_all_that_the_stub_names_is_there() -> None:
    missing = [name for name in dir(racecar) if not hasattr(racecar, name)]
    assert missing == []
    assert {"map_bag", "localize_bag", "Mapper", "Localizer", "Config"} <= set(dir(racecar))


def test_a_map_is_what_the_command_makes(bag: Path, mapped: racecar.MapRun, tmp_path: Path) -> None:
    mapped.save(str(tmp_path / "runs" / "api"))
    assert run(["map", str(bag), "--out", str(tmp_path / "cli"), "--quiet"]) == 0
    for name in WRITTEN:
        assert (tmp_path / "runs" / "api" / name).read_bytes() == (tmp_path / "cli" / name).read_bytes(), name


def test_the_poses_are_those_of_the_command(bag: Path, mapped: racecar.MapRun, tmp_path: Path) -> None:
    mapped.save(tmp_path / "map")
    localized = racecar.localize_bag(bag, str(tmp_path / "map"))
    localized.save(str(tmp_path / "api"))
    for saved in (
        lambda **replace: localized.save(tmp_path / "api", **replace),
        lambda **replace: mapped.save(tmp_path / "map", **replace),
    ):
        with pytest.raises(racecar.UserError, match=r"which would be replaced: .*, or pass replace=True"):
            saved()
        saved(replace=True)
    arguments = ["localize", str(bag), "--map", str(tmp_path / "map"), "--out", str(tmp_path / "cli")]
    assert run([*arguments, "--quiet"]) == 0
    for name in ("trajectory.tum", "overlay.png"):
        assert (tmp_path / "api" / name).read_bytes() == (tmp_path / "cli" / name).read_bytes(), name
    assert localized.reference is not None
    assert len(localized.estimates) == len(localized.trajectory) == 60


def test_a_grid_in_memory_is_a_map(bag: Path, mapped: racecar.MapRun) -> None:
    start = mapped.trajectory.map_from_base[0]
    localized = racecar.localize_bag(bag, mapped.grid, initial_pose=tuple(start))
    away = localized.trajectory.map_from_base[0, :2] - start[:2]
    assert np.hypot(*away) < 0.3
    assert localized.reference is None


def test_what_is_shown(mapped: racecar.MapRun, bag: Path) -> None:
    assert repr(mapped) == f"<MapRun of drive.bag, 60 scans. {mapped.quality.summary}>"
    before = pyplot.get_fignums()
    figure = mapped.plot()
    assert pyplot.get_fignums() == [*before, figure.number]  # type: ignore[attr-defined]  # as show() wants it
    assert len(figure.axes) == 1
    pyplot.close(figure)
    localized = racecar.localize_bag(bag, mapped.grid, initial_pose=mapped.trajectory.map_from_base[0])
    assert repr(localized).startswith("<LocalizationRun of drive.bag, 60 scans. The drive is")
    figure = localized.plot()
    assert len(figure.axes) > 1
    pyplot.close(figure)


def test_a_run_is_a_map_and_gives_what_its_files_give(
    bag: Path, mapped: racecar.MapRun, tmp_path: Path
) -> None:
    mapped.save(tmp_path / "map")
    by_run, by_folder = racecar.localize_bag(bag, mapped), racecar.localize_bag(bag, tmp_path / "map")
    assert by_run.reference is not None
    np.testing.assert_array_equal(by_run.grid.cells, by_folder.grid.cells)
    np.testing.assert_allclose(by_run.trajectory.map_from_base, by_folder.trajectory.map_from_base, atol=1e-6)


def test_cells_in_memory_are_what_they_are_in_files(mapped: racecar.MapRun, tmp_path: Path) -> None:
    mapped.save(tmp_path)
    read, grid = racecar.load_map(tmp_path), mapped.grid
    for name in ("is_occupied", "is_free", "is_unknown"):
        np.testing.assert_array_equal(getattr(grid, name), getattr(read, name), name)
    assert grid.is_occupied.sum() > 1.1 * (grid.cells == 100).sum()
    assert np.all(grid.is_occupied ^ grid.is_free ^ grid.is_unknown)


def test_a_notebook_shows_runs_and_grids(bag: Path, mapped: racecar.MapRun) -> None:
    shown = mapped._repr_html_()
    assert "drive.bag" in shown and mapped.quality.summary in shown and "cells of 0.05 m" in shown
    assert "<polyline" in shown and "data:image/png;base64," in shown
    grid = mapped.grid._repr_html_()
    assert f"{mapped.grid.shape[0]} rows" in grid and "<polyline" not in grid
    localized = racecar.localize_bag(bag, mapped)._repr_html_()
    assert "The drive is" in localized and "60 scans" in localized
    assert len(shown) < 100_000


def test_options_of_a_bag_are_those_of_its_reader(bag: Path) -> None:
    place = [0.5, 0.0, 0.0]
    run = racecar.map_bag(bag, scan_topic="/scan", laser_pose=place, use_odometry=False)
    inputs = run.report.as_dict()["inputs"]
    assert inputs["base_from_laser"] == place
    assert (inputs["scan_topic"], inputs["odom_topic"]) == ("/scan", None)


def test_the_report_is_that_of_the_command(bag: Path, tmp_path: Path) -> None:
    settings = tmp_path / "settings.yaml"
    settings.write_text("mapping: {resolution: 0.1}\n")
    arguments = ["map", str(bag), "--config", str(settings), "--out", str(tmp_path / "cli"), "--quiet"]
    assert run(arguments) == 0
    racecar.map_bag(bag, config=settings).save(tmp_path / "api")
    by_command, by_api = (
        json.loads((tmp_path / name / "report.json").read_text())["inputs"] for name in ("cli", "api")
    )
    assert by_api == by_command
    assert by_api["run_digest"] and by_api["config"] == str(settings)


def test_a_bag_with_chosen_topics_stays_open(bag: Path) -> None:
    with racecar.BagReader(bag, use_odometry=False) as reader:
        alone = racecar.map_bag(reader, config={"mapping": {"resolution": 0.1}})
        assert sum(1 for _ in reader) == 60
    assert alone.grid.resolution == 0.1
    assert any("odometry" in sentence for sentence in alone.warnings)


def test_a_thread_may_map_and_signals_stay_as_they_were(bag: Path) -> None:
    before = signal.getsignal(signal.SIGINT)
    with ThreadPoolExecutor(1) as pool:
        assert len(pool.submit(racecar.map_bag, bag).result().trajectory) == 60
    assert signal.getsignal(signal.SIGINT) == before


def test_mistakes_raise_the_sentence(bag: Path, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"no\.bag"):
        racecar.map_bag(tmp_path / "no.bag")
    with pytest.raises(UserError, match="no map at nowhere"):
        racecar.localize_bag(bag, "nowhere")
    with pytest.raises(UserError, match=r"^The configuration has the unknown key 'mapping\.resolutoin'; did"):
        racecar.map_bag(bag, config={"mapping": {"resolutoin": 0.1}})
    with pytest.raises(UserError, match="give both"):
        racecar.map_bag(bag, initial_pose=(0, 0, 0))
    with pytest.raises(UserError, match="exclude each other"):
        racecar.localize_bag(bag, "building", initial_pose=(0, 0, 0), anywhere=True)
    with pytest.raises(UserError, match="not three finite numbers"):
        racecar.localize_bag(bag, "building", initial_pose=(0, 0))
