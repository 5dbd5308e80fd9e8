"""A localizer's node lives with other drivers than those it was made for, in this order.

Each test leaves the car driving as it should and the node right about where it is.
"""

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from racecar.maps.geometry.se2 import compose
from racecar.pipelines.simulation.laser_models import BASE_FROM_LASER as PLACE
from tests.pipelines.live.live_car import wait_for
from tests.pipelines.live.localizer_stage import RIGHT_AGAIN, Stage, localizer_stage
from tests.pipelines.live.scan_forms import as_cloud, as_echoes


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stage]:
    with localizer_stage(tmp_path_factory.mktemp("odd")) as stage:
        stage.witness.seconds_until_right(10.0)
        yield stage


@pytest.fixture(autouse=True)
def drives_well_afterwards(stage: Stage) -> Iterator[None]:
    yield
    stage.car.spoil, stage.car.frames = lambda message: None, ["laser"]
    stage.car.restamp = dict.fromkeys(("scan", "odometry"), lambda stamp: stamp)
    stage.witness.seconds_until_right(RIGHT_AGAIN)


@pytest.mark.parametrize("kind", ["PointCloud2", "MultiEchoLaserScan", "LaserScan"])
def test_scans_of_another_type_are_found_by_themselves(stage: Stage, kind: str) -> None:
    from sensor_msgs import msg

    forms = {"PointCloud2": as_cloud, "MultiEchoLaserScan": as_echoes, "LaserScan": lambda scan: scan}
    stage.car.say_scans_as(getattr(msg, kind), forms[kind])
    poses = stage.witness.poses
    poses.clear()
    # The silence is noticed after a second, and the new publisher found after another.
    wait_for(lambda: len(poses) > 25, 5.0, stage.witness.said)
    assert max(stage.witness.error(heard) for heard in poses[-15:]) < 0.1


@pytest.mark.parametrize("sensor", ["scan", "odometry"])
def test_stamps_stand_still_for_three_seconds(stage: Stage, sensor: str) -> None:
    since = time.time_ns()
    stage.car.restamp[sensor] = lambda stamp: min(stamp, since)
    name = "scans" if sensor == "scan" else "odometry"
    stage.witness.await_diagnosis(f"The stamps of the {name} show no time")
    time.sleep(2.0)


def test_one_clock_is_set(stage: Stage) -> None:
    stage.car.restamp["scan"] = lambda stamp: stamp + 3_000_000_000
    stage.witness.await_diagnosis("The stamps of the scans jumped by +")
    stage.witness.seconds_until_right(RIGHT_AGAIN)


def test_one_clock_is_set_by_less_than_can_be_seen_of_it_alone(stage: Stage) -> None:
    stage.car.restamp["scan"] = lambda stamp: stamp + 1_600_000_000
    stage.witness.await_diagnosis("The stamps of the scans were 1.6 s ahead of those of the odometry")
    stage.witness.seconds_until_right(RIGHT_AGAIN)
    behind = stage.witness.figure("odometry's clock behind that of the scans (s)")
    assert float(behind or 0.0) == pytest.approx(1.6, abs=0.2)


@pytest.mark.parametrize("sensor", ["scan", "odometry"])
def test_no_stamps_at_all(stage: Stage, sensor: str) -> None:
    stage.car.restamp[sensor] = lambda stamp: 0
    time.sleep(0.5)
    stage.witness.seconds_until_right(RIGHT_AGAIN)


def test_a_laser_that_is_covered_for_ten_seconds(stage: Stage) -> None:
    def cover(message: Any) -> None:
        message.ranges = [float("inf")] * len(message.ranges)

    lost = len(stage.witness.warnings("it may be lost"))
    stage.car.spoil = cover
    stage.witness.await_diagnosis("The scans see nothing within 30 m: the laser is covered")
    time.sleep(9.5)
    assert len(stage.witness.warnings("it may be lost")) == lost


def turn_over(message: Any) -> None:
    """As a laser that hangs upside down says the same."""
    message.ranges = message.ranges[::-1]
    message.time_increment = 0.0


def test_a_laser_that_hangs_upside_down(stage: Stage) -> None:
    stage.car.link("/tf_static", "base_link", "hanging", PLACE, is_upside_down=True)
    time.sleep(0.5)
    stage.car.spoil, stage.car.frames = turn_over, ["hanging"]
    stage.witness.seconds_until_right(RIGHT_AGAIN)


def test_two_lasers_on_one_topic_one_of_them_placed_on_tf(stage: Stage) -> None:
    def turn(message: Any) -> None:
        if message.header.frame_id == "rear":
            message.angle_min -= np.pi
            message.angle_max -= np.pi

    stage.car.spoil, stage.car.frames = turn, ["laser", "rear"]
    stage.witness.await_diagnosis("No transform says where rear sits on base_link")
    for _ in range(8):
        stage.car.link("/tf", "base_link", "rear", compose(PLACE, [0.0, 0.0, np.pi]))
        time.sleep(0.1)
    known = "The place of rear is known now, from tf"
    wait_for(lambda: known in stage.log.read_text(), 5.0, stage.witness.said)
    stage.witness.seconds_until_right(RIGHT_AGAIN)
    time.sleep(0.5)
    assert max(stage.witness.error(heard) for heard in stage.witness.poses[-15:]) < 0.1
