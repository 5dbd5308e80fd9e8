"""A LiDAR of 16 rows maps too, from the bag on."""

import json
from pathlib import Path

import numpy as np
import pytest

from racecar.maps.geometry.se2 import Pose, compose, inverse, transform_points
from racecar.maps.grid.distance_field import distance_to_occupied, sample_field
from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM
from racecar.maps.grid.ray_casting import cast_ray_fan
from racecar.maps.map_files import load_map
from racecar.maps.shipped import shipped_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.files.tum import load_tum
from racecar.pipelines.runs.evaluation.evaluation import compare
from racecar.pipelines.simulation.simulator_config import SimulationConfig
from tests.end_to_end.commands import Racecar
from tests.end_to_end.many_rows import BASE_FROM_SENSOR, CEILING, write_drive
from tests.pipelines.files.test_point_map import read_ply

BEARINGS = np.radians(np.arange(-180.0, 180.0))


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Trajectory]:
    """A bag and the true trajectory."""
    bag = tmp_path_factory.mktemp("many_rows") / "bag"
    return bag, write_drive(bag, "building", 900, SimulationConfig(noise="slight", duration=15.0, seed=4))


@pytest.fixture(scope="module")
def run(racecar: Racecar, drive: tuple[Path, Trajectory], tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("runs") / "map"
    racecar("map", drive[0], "--out", out, "--ply")
    return out


@pytest.fixture(scope="module")
def plan_from_map(drive: tuple[Path, Trajectory], run: Path) -> Pose:
    errors = compare(load_tum(run / "trajectory.tum"), drive[1])
    assert errors.matched == len(drive[1])
    assert errors.positions.mean() < 0.05
    assert np.degrees(errors.headings.mean()) < 0.5
    return errors.reference_from_map


def test_walls_stand_where_the_plan_has_them(run: Path, plan_from_map: Pose) -> None:
    plan, built = load_map(shipped_map("building")), load_map(run)
    centres = (np.argwhere(built.cells >= OCCUPIED_FROM)[:, ::-1] + 0.5) * built.resolution
    walls = transform_points(compose(plan_from_map, built.map_from_grid), centres)
    assert len(walls) > 1000
    assert np.mean(sample_field(distance_to_occupied(plan), plan, walls) < 0.1) > 0.98


def test_no_wall_that_could_be_seen_is_missing(
    drive: tuple[Path, Trajectory], run: Path, plan_from_map: Pose
) -> None:
    plan, built = load_map(shipped_map("building")), load_map(run)
    plan_from_sensor = compose(drive[1].map_from_base[::10], BASE_FROM_SENSOR)
    beams = np.broadcast_to(BEARINGS, (len(plan_from_sensor), len(BEARINGS)))
    ranges = cast_ray_fan(plan, plan_from_sensor, BEARINGS, 12.0)
    ends = compose(plan_from_sensor[:, None], in_direction(ranges, beams))[np.isfinite(ranges)]
    in_map = transform_points(inverse(plan_from_map), ends[:, :2])
    assert np.mean(sample_field(distance_to_occupied(built), built, in_map) < 0.1) > 0.98


def test_the_cloud_of_the_map_stands_in_space(run: Path, plan_from_map: Pose) -> None:
    points = read_ply(run / "points.ply")
    heights = points["z"]
    assert np.quantile(heights, 0.01) == pytest.approx(0.0, abs=0.1)  # the floor, which the rows see, too
    assert heights.max() > 1.5
    plan, is_wall = load_map(shipped_map("building")), (heights > 0.2) & (heights < CEILING - 0.2)
    walls = transform_points(plan_from_map, np.column_stack([points["x"], points["y"]])[is_wall])
    assert len(walls) > 10_000
    assert np.mean(sample_field(distance_to_occupied(plan), plan, walls) < 0.1) > 0.95
    assert len(np.unique(points["red"])) > 50


def test_check_finds_nothing_wrong(racecar: Racecar, drive: tuple[Path, Trajectory], tmp_path: Path) -> None:
    done = racecar("check", drive[0], "--json", tmp_path / "check.json")
    scans = json.loads((tmp_path / "check.json").read_text())["scans"]
    assert "No problems found." in done.stdout
    assert scans["sweep_s"] == pytest.approx(0.1, abs=0.001)


@pytest.mark.slow
def test_without_wheels_the_floor_does_not_hold_the_car_back(
    racecar: Racecar, drive: tuple[Path, Trajectory], tmp_path: Path
) -> None:
    racecar("map", drive[0], "--out", tmp_path, "--no-odom")
    assert compare(load_tum(tmp_path / "trajectory.tum"), drive[1]).positions.mean() < 0.15


def in_direction(ranges: np.ndarray, bearings: np.ndarray) -> Pose:
    """(..., 3) poses that far away; those without an end at the origin."""
    ranges = np.where(np.isfinite(ranges), ranges, 0.0)
    return np.stack([ranges * np.cos(bearings), ranges * np.sin(bearings), np.zeros_like(ranges)], axis=-1)
