"""Nodes that are started for a car whose frames, odometry and clocks are not those that the nodes expect."""

import os
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecar.maps.geometry.se2 import between, wrap_angle
from racecar.pipelines.simulation.laser_models import BASE_FROM_LASER
from racecar.sensors.odometry import Odometry
from tests.pipelines.live.live_car import LiveCar, Witness, recorded, wait_for
from tests.pipelines.live.localizer_stage import Stage, localizer_stage


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
    car.restamp["scan"] = lambda stamp: stamp + 3_000_000_007


def in_degrees(message: Any) -> None:
    message.angle_min, message.angle_max, message.angle_increment = np.degrees(
        [message.angle_min, message.angle_max, message.angle_increment]
    ).tolist()


EXPECTED = (
    "taken from the transforms robot1/odom -> robot1/base_footprint on /tf",
    "The angles of the scans are not radians",
    "The stamps of the scans were 3.0 s ahead of those of the odometry",
)


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
        stage.witness.seconds_until_right(5.0)
        time.sleep(8.0)
        turn_without_scans(stage, 0.1)
        assert float(stage.witness.figure("imu (1/s)") or 0.0) > 10.0


def turn_without_scans(stage: Stage, share: float) -> None:
    """The node still knows the heading after a turn in which the laser was covered, to a share of it."""

    def cover(message: Any) -> None:
        message.ranges = [float("nan")] * len(message.ranges)

    heading = stage.car.place[2]
    stage.car.spoil = cover
    time.sleep(2.0)
    latest = stage.witness.odometry[-1]
    truth = stage.car.truth[latest.stamp]
    turn = abs(wrap_angle(truth[2] - heading))
    assert turn > 0.5
    assert abs(between(truth, latest.pose)[2]) < share * turn


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
        wait_for(lambda: all(each in stage.log.read_text() for each in learned), 40.0, stage.witness.said)
        stage.witness.seconds_until_right(2.0)
        # With the wrong sign it would be off by twice the turn; how far the wheels slip is yet to be learned.
        turn_without_scans(stage, 0.6)


def test_a_localizer_finds_out(tmp_path: Path) -> None:
    with localizer_stage(tmp_path, make_odd) as stage:
        wait_for(lambda: all(each in stage.log.read_text() for each in EXPECTED), 15.0, stage.witness.said)
        stage.witness.seconds_until_right(2.0)
        since = time.monotonic()
        wait_for(lambda: stage.witness.is_right(since, 60), 4.0, stage.witness.said)
        assert "No transform says" not in stage.log.read_text()
        # The car itself repeats its own transforms on the same topic, before and after the node's.
        published = {(parent, child) for parent, child, _ in stage.witness.transforms}
        assert {child for parent, child in published if parent == "map"} == {"robot1/odom"}


def test_a_mapper_finds_out(tmp_path: Path) -> None:
    from racecar.pipelines.live.ros.processes import private_environment, racecar_process
    from racecar.pipelines.live.ros.run import ros_node, served

    log = tmp_path / "log"
    log.touch()
    recorded()
    environment = private_environment(int(os.environ["ROS_DOMAIN_ID"]))
    command = ["live", "map", "--out", str(tmp_path / "out")]
    with ros_node("test_odd_car", []) as node:
        car = LiveCar(node)
        make_odd(car)
        witness = Witness(car, log)
        witness.listen(node)
        with served(node), racecar_process(command, environment, log) as process:
            wait_for(lambda: bool(node.count_subscribers("/scan")), 60.0, witness.said)
            with car.driving():
                wait_for(lambda: all(each in log.read_text() for each in EXPECTED), 15.0, witness.said)
                time.sleep(3.0)
            assert process.poll() is None, witness.said()
    assert "No transform says" not in log.read_text()
    first, last = witness.poses[0], witness.poses[-1]
    assert last.stamp < last.at * 1e9 + (time.time_ns() - time.monotonic_ns())
    moved = between(witness.truth_at(first.stamp), witness.truth_at(last.stamp))
    assert np.hypot(*moved[:2]) > 0.5
    np.testing.assert_allclose(between(first.pose, last.pose), moved, atol=0.1)


@pytest.fixture(autouse=True)
def own_domain(monkeypatch: pytest.MonkeyPatch) -> None:
    from tests.ros_domains import next_domain

    monkeypatch.setenv("ROS_DOMAIN_ID", str(next_domain()))
