"""Nodes that run for a car whose frames, odometry, clocks and drivers are not those that they expect."""

import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecar.maps.geometry.se2 import between, compose, wrap_angle
from racecar.pipelines.simulation.laser_models import BASE_FROM_LASER
from racecar.sensors.odometry import Odometry
from tests.pipelines.live.live_car import LiveCar
from tests.pipelines.live.scan_forms import as_cloud, as_echoes
from tests.pipelines.live.stage import Stage, localizer_stage, mapper_stage, wait_for


def make_odd(car: LiveCar) -> None:
    """The names of another robot; the laser's place, which never changes, and the odometry on /tf alone; the
    laser's clock three seconds ahead, and its angles in degrees."""
    car.hush_place()
    car.hush_odometry()
    car.frames = ["/robot1/laser"]
    car.odometry_links = ("robot1/odom", "robot1/base_footprint")
    car.repeated_links = [
        ("robot1/base_footprint", "robot1/base_link", np.zeros(3)),
        ("robot1/base_link", "robot1/laser", BASE_FROM_LASER),
    ]
    car.spoil = in_degrees
    # By the nanoseconds, the truth at stamps of scans and of odometry is told apart.
    car.restamp_scan = lambda stamp: stamp + 3_000_000_007


def in_degrees(message: Any) -> None:
    message.angle_min, message.angle_max, message.angle_increment = np.degrees(
        [message.angle_min, message.angle_max, message.angle_increment]
    ).tolist()


@pytest.mark.parametrize("start", [localizer_stage, mapper_stage], ids=["localizer", "mapper"])
def test_a_node_finds_out(start: Callable[..., AbstractContextManager[Stage]], tmp_path: Path) -> None:
    with start(tmp_path, make_odd) as stage:
        stage.await_words(
            "taken from the transforms robot1/odom -> robot1/base_footprint on /tf",
            "The angles of the scans are not radians",
            "The stamps of the scans were 3.0 s ahead of those of the odometry",
            within=15.0,
        )
        stage.await_right()
        stage.await_right(4.0, count=60)
        assert "No transform says" not in stage.bus.said
        last = stage.poses[-1]
        assert last.stamp < last.at * 1e9 + (time.time_ns() - time.monotonic_ns())
        # The car itself repeats its own transforms on the same topic, before and after the node's.
        assert {child for parent, child, _ in stage.transforms if parent == "map"} == {"robot1/odom"}


class Straight:
    """Wheels that tell no turn."""

    def __init__(self) -> None:
        self._last: Odometry | None = None
        self._distance = 0.0

    def __call__(self, sample: Odometry) -> Odometry:
        if self._last is not None:
            self._distance += float(between(self._last.odom_from_base, sample.odom_from_base)[0])
        self._last = sample
        twist = np.array([sample.twist[0], 0.0, 0.0])
        return replace(sample, odom_from_base=np.array([self._distance, 0.0, 0.0]), twist=twist)


def test_an_imu_tells_the_turns_where_wheels_do_not(tmp_path: Path) -> None:
    def prepare(car: LiveCar) -> None:
        car.has_imu, car.spoil_odometry = True, Straight()
        car.link("/tf_static", "base_link", "imu", np.zeros(3), is_upside_down=True)

    with localizer_stage(tmp_path, prepare) as stage:
        stage.await_right(5.0)
        time.sleep(8.0)
        turn_without_scans(stage, 0.1)
        assert float(stage.figure("imu (1/s)") or 0.0) > 10.0


def turn_without_scans(stage: Stage, share: float) -> None:
    """The node still knows the heading after a turn in which the laser was covered, to a share of it."""

    def cover(message: Any) -> None:
        message.ranges = [float("nan")] * len(message.ranges)

    heading = stage.car.place[2]
    stage.car.spoil = cover
    wait_for(lambda: abs(wrap_angle(stage.car.place[2] - heading)) > 0.8, stage.said, 20.0)
    latest = stage.odometry[-1]
    assert abs(between(stage.car.truth[latest.stamp], latest.pose)[2]) < share * 0.8


def turn_beams(message: Any) -> None:
    """As drivers do that turn the ranges round: the last is measured first, though not by what they say."""
    message.ranges = message.ranges[::-1]
    message.angle_min, message.angle_max = -message.angle_min, -message.angle_max
    message.angle_increment = -message.angle_increment


def invert(sample: Odometry) -> Odometry:
    """Wheels with left and right exchanged."""
    factors = np.array([1.0, -1.0, -1.0])
    return replace(sample, odom_from_base=sample.odom_from_base * factors, twist=sample.twist * factors)


def test_what_the_first_turns_prove_is_used_from_then_on(tmp_path: Path) -> None:
    def prepare(car: LiveCar) -> None:
        car.spoil, car.spoil_odometry = turn_beams, invert

    with localizer_stage(tmp_path, prepare) as stage:
        learned = ("measured in the opposite order of time", "turns right where the scans turn left")
        stage.await_words(*learned, within=40.0)
        stage.await_right()
        # With the wrong sign it would be off by twice the turn; how far the wheels slip is yet to be learned.
        turn_without_scans(stage, 0.6)


def turn_over(message: Any) -> None:
    """As a laser that hangs upside down says the same."""
    message.ranges = message.ranges[::-1]
    message.time_increment = 0.0


def test_other_types_of_scans_and_places_of_lasers_are_taken_while_driving(tmp_path: Path) -> None:
    from sensor_msgs.msg import LaserScan, MultiEchoLaserScan, PointCloud2

    with localizer_stage(tmp_path) as stage:
        car = stage.car
        stage.await_right()
        for kind, form in (
            (PointCloud2, as_cloud),
            (MultiEchoLaserScan, as_echoes),
            (LaserScan, lambda scan: scan),
        ):
            car.say_scans_as(kind, form)
            before = len(stage.poses)
            # The silence is noticed after a second, and the new publisher found after another.
            wait_for(lambda before=before: len(stage.poses) > before + 25, stage.said, 5.0)
            assert max(stage.errors(stage.poses[-15:])) < 0.1

        car.link("/tf_static", "base_link", "hanging", BASE_FROM_LASER, is_upside_down=True)
        time.sleep(0.5)
        car.spoil, car.frames = turn_over, ["hanging"]
        stage.await_right()

        def turn(message: Any) -> None:
            if message.header.frame_id == "rear":
                message.angle_min -= np.pi
                message.angle_max -= np.pi

        car.spoil, car.frames = turn, ["laser", "rear"]
        stage.await_diagnosis("No transform says where rear sits on base_link")
        for _ in range(8):
            car.link("/tf", "base_link", "rear", compose(BASE_FROM_LASER, [0.0, 0.0, np.pi]))
            time.sleep(0.1)
        stage.await_words("The place of rear is known now, from tf")
        stage.await_right()
        time.sleep(0.5)
        assert max(stage.errors(stage.poses[-15:])) < 0.1
