"""What a node knows of its sensors before anything is mapped."""

import time
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from racecar.pipelines.bags.message_factory import MessageFactory
from racecar.pipelines.bags.messages import MULTI_ECHO_SCAN, ros2_types
from racecar.pipelines.live.intake import sensors as sensors_module
from racecar.pipelines.live.intake.sensors import Sensors
from racecar.pipelines.live.monitoring.faults import Faults
from racecar.sensors.config import SensorConfig
from racecar.sensors.odometry import Odometry

FACTORY = MessageFactory(ros2_types(), is_ros1=False)
START = 1_700_000_000_000_000_000


def sensors(said: list[str] | None = None, config: SensorConfig | None = None) -> Sensors:
    return Sensors(
        base_frame="base_link",
        laser_pose=None,
        integrate_twist=False,
        faults=Faults((said if said is not None else []).append, lambda sentence: None),
        aside=lambda work: work(),
        config=config,
    )


def scan(seconds: float, frame: str = "laser", ranges: Any = (1.0, 2.0, 3.0)) -> Any:
    layout = {"angle_min": -0.1, "angle_increment": 0.1, "time_increment": 0.0, "scan_time": 0.1}
    limits = {"range_min": 0.1, "range_max": 30.0}
    values = np.array(ranges, dtype=np.float32)
    return FACTORY.laser_scan(START + round(seconds * 1e9), frame, values, **layout, **limits)


def odometry(seconds: float) -> Any:
    stamp = START + round(seconds * 1e9)
    return FACTORY.odometry(stamp, "odom", "base_link", np.zeros(3), np.zeros(3), None)


def at(seconds: float) -> int:
    return round(seconds * 1e9)


@pytest.mark.parametrize("off", [-3.0, 0.0, 0.1, 3.0])
def test_the_first_messages_tell_how_the_clocks_disagree(off: float) -> None:
    said: list[str] = []
    taking = sensors(said)
    waiting = []
    answers = []
    for i in range(60):
        waiting.append((False, odometry(i * 0.02 - off), at(i * 0.02)))
        if i % 5 == 0:
            waiting.append((True, scan(i * 0.02), at(i * 0.02 + 0.001)))
        answers.append(taking.compare_clocks(waiting))
        if answers[-1]:
            break
    assert answers[-1]
    assert len(answers) < 5 if abs(off) < 0.5 else len(answers) > 40
    known = taking.scan(scan(0.0), at(0.0)), taking.odometry(odometry(-off), at(0.0))
    assert isinstance(known[1], Odometry)
    assert known[0] is not None
    expected = off if abs(off) > 0.5 else 0.0
    assert known[1].stamp - known[0].stamp == pytest.approx((expected - off) * 1e9, abs=5e6)
    assert [f"{abs(off):.1f} s" in sentence for sentence in said if "odometry" in sentence] == [True] * (
        expected != 0.0
    )


@pytest.mark.parametrize("is_mapped", [True, False])
@pytest.mark.parametrize(("of_scans", "of_odometry"), [(3.0, 0.0), (-3.0, 0.1), (0.0, 3.0), (500.0, 503.0)])
def test_of_two_clocks_that_disagree_the_one_that_is_right_counts(
    monkeypatch: pytest.MonkeyPatch, is_mapped: bool, of_scans: float, of_odometry: float
) -> None:
    computer = SimpleNamespace(time_ns=lambda: START, monotonic_ns=lambda: 0, monotonic=time.monotonic)
    monkeypatch.setattr(sensors_module, "time", computer)
    said: list[str] = []
    taking = sensors(said)
    waiting = []
    for i in range(60):
        waiting.append((False, odometry(i * 0.02 + of_odometry), at(i * 0.02)))
        waiting.append((True, scan(i * 0.02 + of_scans), at(i * 0.02 + 0.001)))
    if is_mapped:
        assert taking.compare_clocks(waiting)
    for is_scan, message, arrival in waiting:
        taken = (taking.scan if is_scan else taking.odometry)(message, arrival)
    assert taken is not None
    is_of_scans = abs(of_odometry) < 1.0
    expected = of_scans - of_odometry if is_of_scans else 0.0
    assert taking.clock_error(message) == pytest.approx(expected * 1e9, abs=5e6)
    if is_mapped:
        true = START + at(59 * 0.02 + (0.0 if is_of_scans else of_scans))
        assert taken.stamp == pytest.approx(true, abs=0.11e9)
    blamed = [("stamps of the scans were" in sentence) for sentence in said if "Synchronize" in sentence]
    assert blamed == [is_of_scans]


@pytest.mark.parametrize("has_echoes", [False, True])
@pytest.mark.parametrize("is_mapped", [True, False])
def test_angles_in_degrees_are_found_by_the_scans(is_mapped: bool, has_echoes: bool) -> None:
    said: list[str] = []
    taking = sensors(said)
    bearings = np.radians(np.arange(-90.0, 90.0))
    messages = [square_room(bearings, 0.01 * i) for i in range(30)]
    if has_echoes:
        messages = [multi_echo(message) for message in messages]
    if is_mapped:
        waiting = [(True, message, at(0.1 * i)) for i, message in enumerate(messages)]
        assert not taking.understands(waiting[:3])
        taking.understands(waiting)
    for i, message in enumerate(messages):
        taken = taking.scan(message, at(0.1 * i))
        assert taken is not None or (i < 10 and not is_mapped)
    assert taken is not None
    np.testing.assert_allclose(taken.bearings, bearings, atol=1e-6)
    assert any("angles of the scans contradict each other" in sentence for sentence in said)


def multi_echo(message: Any) -> Any:
    """A LaserScan as the MultiEchoLaserScan of a sensor that sees one echo."""
    types = ros2_types().types
    fields = {name: value for name, value in vars(message).items() if not name.startswith("_")}
    beams = [types["sensor_msgs/msg/LaserEcho"](echoes=np.array([each])) for each in message.ranges]
    return types[MULTI_ECHO_SCAN](**{**fields, "ranges": beams, "intensities": []})


def square_room(bearings: Any, forward: float) -> Any:
    """A scan in the middle of a room of 6 m, with angles in degrees, but ``angle_max`` in radians."""
    to_front, to_sides = 3.0 - forward, 3.0
    with np.errstate(divide="ignore"):
        ranges = np.minimum(
            np.where(np.cos(bearings) > 0, to_front / np.cos(bearings), np.inf),
            to_sides / np.abs(np.sin(bearings)),
        )
    message = scan(forward, ranges=ranges)
    message.angle_min, message.angle_increment = -90.0, 1.0
    message.angle_max = float(np.radians(89.0))
    return message


def test_scans_that_repeat_themselves_while_the_car_moves_are_left_out() -> None:
    said: list[str] = []
    taking = sensors(said)
    rng = np.random.default_rng(0)
    stuck = rng.uniform(1.0, 5.0, 50)
    taken = []
    for index in range(60):
        message = odometry(index * 0.1)
        message.pose.pose.position.x = 0.1 * index
        taking.odometry(message, at(index * 0.1))
        ranges = stuck if 20 <= index < 40 else rng.uniform(1.0, 5.0, 50)
        taken.append(taking.scan(scan(index * 0.1 + 0.01, ranges=ranges), at(index * 0.1 + 0.01)) is not None)
    assert taken == [True] * 21 + [False] * 19 + [True] * 20
    assert sum("repeat themselves" in sentence for sentence in said) == 1


def test_the_settings_say_how_far_readings_count() -> None:
    taken = sensors(config=SensorConfig(max_range=2.5)).scan(scan(0.0), 0)
    assert taken is not None
    np.testing.assert_array_equal(taken.ranges, [1.0, 2.0, np.inf])
