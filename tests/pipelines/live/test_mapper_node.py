"""A mapper's node drives with a simulated car, saves, is killed and goes on, in this order."""

import pickle
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from racecar.maps.geometry.se2 import transform_points
from racecar.maps.grid.distance_field import distance_to_occupied, sample_field
from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM
from racecar.maps.map_files import load_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.files.tum import load_tum
from racecar.pipelines.live.saving import map_saving
from racecar.pipelines.runs.evaluation.evaluation import compare
from tests.pipelines.live.live_car import ring
from tests.pipelines.live.stage import Stage, mapper_stage, wait_for


@pytest.fixture(scope="module")
def stage(folder: Path) -> Iterator[Stage]:
    with mapper_stage(folder) as stage:
        yield stage


def test_the_car_is_placed_from_its_first_scan_on(stage: Stage) -> None:
    wait_for(lambda: bool(stage.poses), stage.said, 2.0)
    time.sleep(3.0)
    assert len(stage.poses) == pytest.approx(stage.car.scans_sent, abs=1)
    assert max(stage.errors(stage.poses)) < 0.1


def test_the_map_comes_again_and_again_and_shows_the_walls(stage: Stage) -> None:
    from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage

    from racecar.pipelines.live.ros.messages import grid_of
    from racecar.pipelines.live.ros.qos import LATCHED

    maps = stage.hear("/map", OccupancyGridMessage, LATCHED)
    wait_for(lambda: len(maps) > 3, stage.said, 3.0)
    grid, plan = grid_of(maps[-1]), ring()
    walls = transform_points(stage.plan_from_map, grid.center_of(np.argwhere(grid.cells >= OCCUPIED_FROM)))
    assert len(walls) > 200
    assert np.median(sample_field(distance_to_occupied(plan), plan, walls)) < 0.06


def test_map_to_odometry_and_the_graph_are_published(stage: Stage) -> None:
    from visualization_msgs.msg import MarkerArray

    from racecar.pipelines.live.ros.qos import LATCHED

    heard = stage.hear("/pose_graph", MarkerArray, LATCHED)
    wait_for(lambda: bool(heard), stage.said, 6.0)
    keyframes, loops, submaps = heard[-1].markers
    assert (keyframes.ns, loops.ns, submaps.ns) == ("keyframes", "loop closures", "submaps")
    assert len(keyframes.points) > 5
    assert {(parent, child) for parent, child, _ in stage.transforms} == {("map", "odom")}


def test_the_service_saves_a_map_while_the_car_drives_on(
    stage: Stage, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from std_srvs.srv import Trigger

    # It takes a process of low priority, which does not get on where other programs run.
    monkeypatch.setattr(map_saving, "in_fresh_process", lambda work, **_: pickle.loads(pickle.dumps(work))())
    before = len(stage.poses)
    answer = stage.bus.call("/save_map", Trigger.Request())
    assert answer.success, answer.message
    assert str(folder / "out") in answer.message
    assert load_map(folder / "out").cells.size > 1000
    files = {path.name for path in (folder / "out").iterdir()}
    assert {"map.png", "session.npz", "trajectory.tum", "report.json"} <= files
    assert len(stage.poses) > before
    stage.await_right()


def test_a_killed_node_goes_on_with_the_map_and_saves_it_at_the_end(stage: Stage, folder: Path) -> None:
    log, saved = folder / "out.drive.log", folder / "out" / "map.yaml"
    before = saved.stat().st_mtime_ns
    stage.kill()
    assert log.is_file()
    time.sleep(3.0)
    stage.car.hush_place()  # as when /tf_static comes later than the first scans
    stage.map(folder / "out")
    stage.await_right(4.0)
    assert "the drive goes on from" in stage.bus.said
    assert stage.warnings("where it was in the last run")
    assert not stage.warnings("it is taken to be there")
    stage.live.stop()
    said: list[str] = []
    stage.live.drive.save(said.append)
    assert [each.split(";")[0] for each in said] == ["Optimizing the map"]
    assert saved.stat().st_mtime_ns > before
    assert not log.exists()
    stamps = np.array(sorted(stage.car.undisturbed), dtype=np.int64)
    truth = Trajectory(stamps, np.array([stage.car.undisturbed[stamp] for stamp in stamps.tolist()]))
    errors = compare(load_tum(folder / "out" / "trajectory.tum"), truth)
    assert errors.matched > 0.9 * errors.total
    assert errors.positions.mean() < 0.05
