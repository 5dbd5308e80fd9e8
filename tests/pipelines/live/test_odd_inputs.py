"""A localizer's node lives with other drivers than those it was made for, in this order.

Each test leaves the car driving as it should and the node right about where it is.
"""

import time
from collections.abc import Iterator
from typing import Any

import pytest

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
    stage.car.spoil = lambda message: None
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
    stage.witness.await_diagnosis("The stamps of the scans jumped by +3.0 s")
    stage.witness.seconds_until_right(RIGHT_AGAIN)


def test_one_clock_is_set_by_less_than_can_be_seen_of_it_alone(stage: Stage) -> None:
    stage.car.restamp["scan"] = lambda stamp: stamp + 1_600_000_000
    stage.witness.await_diagnosis("The stamps of the odometry were 1.6 s behind those of the scans")
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
