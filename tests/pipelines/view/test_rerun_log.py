"""Scenes become recordings that rerun reads."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.cli import run
from racecar.pipelines.files.tum import save_tum
from racecar.pipelines.view.scene import ParticleCloud, Scene, Sight

pytest.importorskip("rerun")

STAMPS = 10**9 + 10**8 * np.arange(20)
PATH = np.column_stack([np.linspace(0.0, 2.0, 20), np.zeros(20), np.linspace(0.0, 0.4, 20)])


def whole_scene() -> Scene:
    cells = np.full((40, 60), FREE, dtype=np.int8)
    cells[0] = OCCUPIED
    return Scene(
        "run",
        "words",
        Trajectory(STAMPS, PATH),
        OccupancyGrid(cells, 0.1, np.array([-1.0, -2.0, 0.5])),
        PATH[::5, :2],
        PATH[None, [0, 19], :2],
        [Sight(int(stamp), np.ones((5, 2), dtype=np.float32)) for stamp in STAMPS],
        [ParticleCloud(int(stamp), np.tile(pose, (4, 1))) for stamp, pose in zip(STAMPS, PATH, strict=True)],
        np.tile(0.1 * np.eye(3), (20, 1, 1)),
    )


def entities(path: Path) -> str:
    """What the recording tool of rerun prints of a file."""
    command = [sys.executable, "-m", "rerun_cli", "rrd", "print", "-vv", str(path)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def test_everything_of_a_scene_is_in_the_recording(tmp_path: Path) -> None:
    from racecar.pipelines.view.rerun_log import save_recording

    save_recording(whole_scene(), tmp_path / "run.rrd")
    printed = entities(tmp_path / "run.rrd")
    for name in ("grid", "path", "keyframes", "loop_closures", "car", "car/scan", "driven", "particles"):
        assert f"/map/{name}" in printed, name
    assert "/deviation/place" in printed
    assert "/about" in printed


def test_a_bare_trajectory_can_be_shown(tmp_path: Path) -> None:
    from racecar.pipelines.view.rerun_log import save_recording

    save_recording(Scene("run", "words", Trajectory(STAMPS, PATH)), tmp_path / "run.rrd")
    printed = entities(tmp_path / "run.rrd")
    assert "/map/path" in printed
    assert "/map/grid" not in printed


def test_the_command_saves_a_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    save_tum(Trajectory(STAMPS, PATH), tmp_path / "trajectory.tum")
    assert run(["view", str(tmp_path), "--save", str(tmp_path / "out" / "run.rrd")]) == 0
    assert (tmp_path / "out" / "run.rrd").stat().st_size > 1000
    assert "run.rrd" in capsys.readouterr().out


@pytest.mark.parametrize(("name", "complaint"), [("missing", "There is no folder"), ("", "holds no run")])
def test_mistakes_are_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, complaint: str
) -> None:
    assert run(["view", str(tmp_path / name)]) == 2
    shown = capsys.readouterr()
    assert complaint in shown.err
    assert shown.err.count("\n") == 1
