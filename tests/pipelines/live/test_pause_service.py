"""A mapper is paused while the car drives on."""

import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from racecar.maps.geometry.se2 import transform_points
from racecar.maps.grid.distance_field import distance_to_occupied, sample_field
from racecar.pipelines.live.saving.drive_log import DriveLog
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.pipelines.live.foreign_services import install, service
from tests.pipelines.live.live_car import ring
from tests.pipelines.live.stage import Stage, car_stage

_PAUSE = 3.0
"""Seconds, in which the car drives 9 m."""


@pytest.fixture(scope="module")
def stage(folder: Path) -> Iterator[Stage]:
    """A mapper of a car that drives at 3 m/s."""
    with pytest.MonkeyPatch.context() as patch, car_stage() as stage:
        install(patch, "slam_toolbox", Pause=service(status=False))
        stage.map(folder / "out")
        stage.car.drive(30.0, 3.0)
        time.sleep(6.0)
        yield stage


def toggle(stage: Stage) -> None:
    assert stage.bus.call("/slam_toolbox/pause_new_measurements", SimpleNamespace()).status


def test_the_car_is_where_the_wheels_say_while_it_is_paused_and_the_map_goes_on_there(stage: Stage) -> None:
    for _ in range(2):
        toggle(stage)
        mapped, heard = stage.live.drive.last_stamp, len(stage.poses)
        transforms = len(stage.transforms)
        time.sleep(_PAUSE)
        assert stage.live.drive.last_stamp == mapped
        assert len(stage.poses) - heard == pytest.approx(40 * _PAUSE, abs=3)
        assert len(stage.transforms) - transforms == len(stage.poses) - heard
        assert max(stage.errors(stage.poses[heard:])) < 0.5
        toggle(stage)
        stage.await_right()
        time.sleep(3.0)
    session = stage.live.drive.mappers[-1].session()
    walls = transform_points(stage.plan_from_map, session.points)
    assert np.quantile(sample_field(distance_to_occupied(ring()), ring(), walls), 0.95) < 0.2


def test_it_is_told_and_no_scans_are_missed(stage: Stage) -> None:
    toggle(stage)
    stage.await_diagnosis("Mapping is paused")
    time.sleep(2.0)
    assert {status.message for status in stage.statuses[-2:]} == {
        "Mapping is paused: scans are left out, and the car is where the odometry says."
    }
    toggle(stage)
    stage.await_diagnosis("fine")
    assert stage.warnings("Mapping is paused") == 3
    assert "[INFO] Mapping goes on." in stage.bus.log


def test_the_log_holds_the_odometry_alone_and_a_killed_drive_goes_on_the_same(
    stage: Stage, folder: Path
) -> None:
    toggle(stage)
    time.sleep(1.0)
    before = stage.live.drive.mappers[-1].session()
    stage.car.scans_on = False
    stage.kill()
    entries = list(DriveLog(folder / "out").entries())
    stamps = np.array([each.stamp for each in entries if isinstance(each, Scan)])
    gaps = np.flatnonzero(np.diff(stamps) > 2e9)
    assert len(gaps) == 3
    moved = [each.stamp for each in entries if isinstance(each, Odometry)]
    assert max(np.diff(moved)) < 0.1e9
    assert moved[-1] - stamps[-1] > 0.8e9
    stage.map(folder / "out")
    stage.await_words("The drive until then is mapped again")
    after = stage.live.drive.mappers[-1].session()
    assert np.array_equal(before.map_from_base, after.map_from_base)
    stage.car.scans_on = True


def test_a_renewed_node_is_not_paused(stage: Stage) -> None:
    request = SimpleNamespace(data=True)
    assert stage.bus.call("/pause_new_measurements", request).message.startswith("Mapping is paused")
    mapped = stage.live.drive.last_stamp
    stage.live.stop()
    stage.live = stage.live.renewed()
    stage.live.start()
    stage.await_right()
    assert stage.live.drive.last_stamp > mapped
