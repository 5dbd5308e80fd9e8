"""``racecar track``: the file for the optimizer, and what is said where there is no track."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree
from shapely import LinearRing

from racecar.maps.geometry.closed_line import ring_length
from racecar.maps.geometry.se2 import transform_points
from racecar.maps.grid.centre_line import CentreLine
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from racecar.maps.grid.ray_casting import cast_rays
from racecar.maps.grid.track_bounds import Bound
from racecar.maps.map_files import load_map
from racecar.pipelines.commands.cli import run
from racecar.pipelines.files.report import Report
from racecar.pipelines.files.tum import load_tum
from racecar.pipelines.runs.evaluation.evaluation import compare
from racecar.pipelines.runs.track_run import MeasuredTrack, save_track
from racecar.pipelines.simulation.driver import CarMotion, drive_route
from racecar.pipelines.simulation.driving_lattice import Route
from racecar.pipelines.simulation.simulator import Simulation, ground_truth_file, write_bag
from racecar.pipelines.simulation.simulator_config import SimulationConfig


def test_what_is_written(tmp_path: Path) -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 100, endpoint=False)
    points = 3.0 * np.column_stack([np.cos(angles), np.sin(angles)])
    right, left = (Bound(np.full(100, width), angles > 1.0, angles > 0.0) for width in (0.75, 1.25))
    line = CentreLine(points, right, left)
    grid = OccupancyGrid(np.zeros((200, 200), dtype=np.int8), 0.05, np.array([-5.0, -5.0, 0.0]))
    report = Report("racecar track")
    save_track(MeasuredTrack(grid, line), report, tmp_path, "ring")
    assert (tmp_path / "track.csv").read_text().splitlines()[0] == "# x_m,y_m,w_tr_right_m,w_tr_left_m"
    rows = np.loadtxt(tmp_path / "track.csv", comments="#", delimiter=",")
    np.testing.assert_allclose(rows, np.column_stack([points, right.widths, left.widths]), atol=1e-4)
    assert (tmp_path / "track.png").stat().st_size > 10_000
    assert report.as_dict()["track"]["length_m"] == pytest.approx(2.0 * np.pi * 3.0, rel=1e-3)


def test_a_drive_that_closes_no_lap_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag, out = tmp_path / "drive.bag", tmp_path / "map"
    assert run(["simulate", "--map", "track", "--out", str(bag), "--duration", "3", "--quiet"]) == 0
    assert run(["map", str(bag), "--out", str(out), "--quiet"]) == 0
    capsys.readouterr()
    assert run(["track", str(out)]) == 2
    told = capsys.readouterr().err
    assert "There is no closed lap" in told
    assert told.count("\n") == 1
    assert not (out / "track.csv").exists()
    assert run(["track", str(tmp_path)]) == 2
    assert "There is no session.npz" in capsys.readouterr().err


@pytest.mark.slow
def test_the_shipped_track_is_found_as_it_was_drawn(tmp_path: Path) -> None:
    """Closed, without crossing, and its widths within 5 cm of the drawing: of what it shows within 5 cm along
    the track and a degree, since beside a corner a width jumps."""
    bag, out = tmp_path / "drive.bag", tmp_path / "map"
    assert run(["simulate", "--map", "track", "--out", str(bag), "--noise", "slight", "--quiet"]) == 0
    assert run(["map", str(bag), "--out", str(out), "--quiet"]) == 0
    assert run(["track", str(out), "--json", str(tmp_path / "track.json"), "--quiet"]) == 0
    assert json.loads((tmp_path / "track.json").read_text())["warnings"] == []
    rows = np.loadtxt(out / "track.csv", comments="#", delimiter=",")
    truth = load_tum(ground_truth_file(bag))
    aligned = compare(load_tum(out / "trajectory.tum"), truth).reference_from_map
    points = transform_points(aligned, rows[:, :2])
    assert LinearRing(points).is_simple
    for widths, towards in ((rows[:, 2], -np.pi / 2), (rows[:, 3], np.pi / 2)):
        drawn = np.array([drawn_widths(points, along, towards + turn) for along, turn in AROUND])
        assert np.mean(np.abs(widths - drawn[0]) < 0.05) > 0.9
        beyond = np.maximum(drawn.min(axis=0) - widths, widths - drawn.max(axis=0))
        assert np.max(beyond) < 0.05


class FigureOfEight(Simulation):
    """A drive along a given closed line instead of one that the car plans."""

    def _drive(self) -> CarMotion:
        ahead = np.gradient(EIGHT, axis=0)
        poses = np.column_stack([EIGHT, np.arctan2(ahead[:, 1], ahead[:, 0])])
        route = Route(poses, np.zeros(len(poses), dtype=np.bool_))
        return drive_route(route, self._grid, self._lattice.clearance, self._config.max_speed, rounds=2)


ANGLES = np.linspace(0.9, 0.9 + 2.0 * np.pi, 1000)
EIGHT = np.column_stack([8.0 * np.sin(ANGLES), 4.0 * np.sin(2.0 * ANGLES)])
HALF_WIDTH = 1.1


@pytest.mark.slow
def test_a_figure_of_eight_is_found_from_end_to_end(tmp_path: Path) -> None:
    bag, out = tmp_path / "drive.bag", tmp_path / "map"
    grid = OccupancyGrid(np.zeros((550, 950), dtype=np.int8), 0.02, np.array([-9.5, -5.5, 0.0]))
    away, _ = cKDTree(EIGHT).query(grid.center_of(np.argwhere(grid.cells == FREE)))
    grid.cells[away.reshape(grid.shape) > HALF_WIDTH] = OCCUPIED
    simulation = FigureOfEight(grid, SimulationConfig(noise="slight"))
    write_bag(simulation, bag, lambda _: None)
    assert run(["map", str(bag), "--out", str(out), "--quiet"]) == 0
    assert run(["track", str(out), "--json", str(tmp_path / "track.json"), "--quiet"]) == 0
    (warning,) = json.loads((tmp_path / "track.json").read_text())["warnings"]
    assert "a side is no wall" in warning
    rows = np.loadtxt(out / "track.csv", comments="#", delimiter=",")
    assert ring_length(rows[:, :2]) == pytest.approx(ring_length(EIGHT), rel=0.02)
    aligned = compare(load_tum(out / "trajectory.tum"), simulation.ground_truth).reference_from_map
    assert cKDTree(EIGHT).query(transform_points(aligned, rows[:, :2]))[0].max() < 0.1
    np.testing.assert_allclose(rows[:, 2:], HALF_WIDTH, atol=0.15)


AROUND = [(along, turn) for along in (0.0, -0.05, 0.05) for turn in (0.0, -0.02, 0.02)]


def drawn_widths(points: np.ndarray, along: float, towards: float) -> np.ndarray:
    """(N,) metres on the drawing, so far along the line from each point and in that direction off it."""
    track = load_map("track")
    is_free = (track.cells >= FREE) & (track.cells < OCCUPIED)
    track = replace(track, cells=np.where(is_free, FREE, OCCUPIED).astype(np.int8))
    ahead = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    ahead /= np.hypot(*ahead.T)[:, None]
    poses = np.column_stack([points + along * ahead, np.arctan2(ahead[:, 1], ahead[:, 0])])
    return cast_rays(track, poses, np.full(len(points), towards), 50.0)
