"""What is read from a run's folder."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from racecar.mapping.loops.loop_history import LoopHistory
from racecar.mapping.session.recordings import KeyframeTimes, Recording
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import between, compose
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from racecar.maps.map_files import save_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.files.session_file import SESSION_FILE, load_arrays, save_arrays
from racecar.pipelines.files.tum import save_tum
from racecar.pipelines.runs.view.recorder import recording
from racecar.pipelines.runs.view.run_folder import load_run
from racecar.sensors.arrays import named
from racecar.sensors.scan import Scan

STAMPS = 10**9 + 10**8 * np.arange(20)
PATH = np.column_stack([np.linspace(0.0, 2.0, 20), np.zeros(20), np.linspace(0.0, 0.4, 20)])
BASE_FROM_LASER = np.array([0.3, 0.1, 0.2])


@pytest.fixture
def grid() -> OccupancyGrid:
    cells = np.full((40, 60), FREE, dtype=np.int8)
    cells[0] = OCCUPIED
    return OccupancyGrid(cells, 0.1, np.array([-1.0, -2.0, 0.0]))


@pytest.fixture
def run(tmp_path: Path) -> Path:
    save_tum(Trajectory(STAMPS, PATH), tmp_path / "trajectory.tum")
    return tmp_path


def save_session(folder: Path) -> None:
    """Three keyframes, the last two tied by a loop closure; the first, which is of an earlier drive, is tied
    to the second by a match that the map misses by half a metre."""
    keyframes = np.vstack([[9.0, 9.0, 0.0], PATH[[4, 10]]])
    laser_from_base = np.array([-0.3, -0.1, 0.0])
    base_from_laser = np.array([0.3, 0.1, 0.0])
    map_from_keyframe = compose(keyframes, base_from_laser)
    matched = between(map_from_keyframe[:2], map_from_keyframe[1:])
    matched[0, :2] += [0.3, 0.4]
    earlier, own = (KeyframeTimes.of(Recording("", 0, 1), stamps) for stamps in (STAMPS[:1], STAMPS[[4, 10]]))
    times = earlier.followed_by(own, is_newer=True)
    arrays = {
        "keyframe_from_base": np.tile(laser_from_base, (3, 1)),
        "map_from_keyframe": map_from_keyframe,
        "constraints.poses": matched,
        "constraints.keyframes": np.array([[0, 1], [1, 2]], dtype=np.int32),
        "constraints.kinds": np.array([1, 2], dtype=np.int8),
        "scans.counts": np.array([1, 2, 1], dtype=np.int16),
        "scans.points": np.array([[5, 5], [1, 0], [2, 0], [3, 0]], dtype=np.float32),
        "scans.normals": np.zeros((4, 2), dtype=np.float32),
        "rays.lengths": np.zeros(3, dtype=np.int64),
        "rays.returns": np.zeros(3, dtype=np.int64),
        "rays.ends": np.zeros((0, 2), dtype=np.float32),
        "constraints.information": np.tile(np.eye(3), (2, 1, 1)),
        **named("times", times.to_arrays()),
        **named("loops", LoopHistory().to_arrays()),
        "loops.path": np.zeros(3),
    }
    save_arrays(arrays, folder / SESSION_FILE)


def test_a_trajectory_alone_is_a_run(run: Path) -> None:
    scene = load_run(run)
    np.testing.assert_array_equal(scene.trajectory.stamps, STAMPS)
    assert scene.title == run.name
    assert scene.grid is None
    assert not scene.sights


def test_a_mapping_run_shows_its_keyframes_loops_and_their_scans(run: Path, grid: OccupancyGrid) -> None:
    save_map(grid, run / "map.yaml")
    save_session(run)
    scene = load_run(run)
    assert scene.grid is not None
    np.testing.assert_allclose(scene.keyframes[1:], PATH[[4, 10], :2], atol=1e-9)
    np.testing.assert_allclose(scene.loops, [PATH[[4, 10], :2]], atol=1e-9)
    np.testing.assert_allclose(scene.matches, [[[9.0, 9.0], PATH[4, :2]]], atol=1e-9)
    np.testing.assert_allclose(scene.misses, [0.5], atol=1e-9)
    assert [sight.stamp for sight in scene.sights] == STAMPS[[4, 10]].tolist()
    np.testing.assert_allclose(scene.sights[0].points_in_base, [[1.3, 0.1], [2.3, 0.1]], atol=1e-6)


def test_a_localization_run_shows_the_map_its_report_names(
    run: Path, grid: OccupancyGrid, tmp_path_factory: pytest.TempPathFactory
) -> None:
    elsewhere = tmp_path_factory.mktemp("map")
    save_map(grid, elsewhere / "map.yaml")
    report = {"command": "racecar localize", "inputs": {"map": str(elsewhere)}, "warnings": ["Look twice."]}
    (run / "report.json").write_text(json.dumps(report))
    scene = load_run(run)
    assert scene.grid is not None
    assert scene.grid.cells.shape == grid.cells.shape
    assert "racecar localize" in scene.about
    assert "Look twice." in scene.about


def test_a_recording_shows_everything(run: Path, grid: OccupancyGrid) -> None:
    bearings = np.linspace(-1.0, 1.0, 5)
    with recording(run, grid) as recorder:
        for stamp, pose in zip(STAMPS.tolist(), PATH, strict=True):
            scan = Scan(stamp, bearings, np.full(5, 2.0), np.zeros(5), BASE_FROM_LASER, 10.0)
            recorder.write_scan(scan, pose, np.diag([0.03, 0.01, 0.04]))
            recorder.write_particles(stamp, np.tile(pose, (4, 1)), np.full(4, 0.25))
    scene = load_run(run)
    np.testing.assert_allclose(scene.trajectory.map_from_base, PATH, atol=1e-9)
    np.testing.assert_allclose(scene.deviations, np.tile([0.2, 0.2], (20, 1)))
    assert scene.grid is not None
    np.testing.assert_array_equal(scene.grid.cells, grid.cells)
    assert len(scene.sights) == len(scene.clouds) == 20
    middle = compose(BASE_FROM_LASER, np.array([2.0, 0.0, 0.0]))[:2]
    np.testing.assert_allclose(scene.sights[3].points_in_base[2], middle, atol=1e-5)
    np.testing.assert_allclose(scene.clouds[3].map_from_base, np.tile(PATH[3], (4, 1)), atol=1e-9)


def test_a_recording_of_an_earlier_run_is_left_aside(run: Path, grid: OccupancyGrid) -> None:
    with recording(run, grid) as recorder:
        bearings = np.linspace(-1.0, 1.0, 5)
        scan = Scan(int(STAMPS[0]), bearings, np.ones(5), np.zeros(5), BASE_FROM_LASER, 10.0)
        recorder.write_scan(scan, PATH[0])
    scene = load_run(run)
    assert len(scene.trajectory) == 20
    assert "earlier run" in scene.about


def test_an_empty_folder_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="holds no run"):
        load_run(tmp_path)


def test_of_a_report_what_is_right_is_shown(run: Path) -> None:
    report = {
        "command": "racecar map",
        "counts": {"scans": [], "path_metres": 12.0},
        "quality": {"verdict": "good", "segments": 3},
        "warnings": None,
    }
    (run / "report.json").write_text(json.dumps(report))
    about = load_run(run).about
    assert "path: 12.0 m" in about
    assert "verdict: good" in about
    assert "what it says of scans, segments is left out" in about


def spoil_session(run: Path, poses: np.ndarray) -> None:
    save_session(run)
    save_arrays(load_arrays(run / SESSION_FILE) | {"map_from_keyframe": poses}, run / SESSION_FILE)


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        *(
            (lambda run, text=text: (run / "report.json").write_text(text), "report.json is damaged")
            for text in ("{", "7", "[" * 5000, '{"a": ' * 50 + "1" + "}" * 50, '{"a": ' + "9" * 5000 + "}")
        ),
        *(
            (lambda run, poses=poses: spoil_session(run, poses), "session.npz is damaged")
            for poses in (np.array(3.0), np.full((3, 3), np.nan), np.zeros((2, 3)))
        ),
        (lambda run: (run / "map.yaml").write_text("image: map.pgm"), "map.yaml"),
        (lambda run: (run / "floor_plan.yaml").write_text("image: plan.png"), "resolution"),
    ],
)
def test_a_damaged_file_hides_nothing_else(run: Path, spoil: Callable[[Path], object], words: str) -> None:
    spoil(run)
    scene = load_run(run)
    assert len(scene.trajectory) == 20
    assert words in scene.about


def test_a_folder_named_record_that_is_no_recording_is_one_sentence(run: Path) -> None:
    (run / "record").mkdir()
    with pytest.raises(UserError):
        load_run(run)
