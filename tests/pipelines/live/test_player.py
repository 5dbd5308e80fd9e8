"""A bag is played as it was recorded."""

import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from racecar.maps.errors import UserError
from racecar.pipelines.bags.messages import nanoseconds
from racecar.pipelines.bags.writer import BagWriter
from racecar.pipelines.simulation.laser_models import BASE_FROM_LASER, UST_10LX
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from tests.pipelines.live.live_car import recorded
from tests.pipelines.live.stage import car_stage, wait_for

SCANS, PERIOD = 20, 50_000_000
SECOND = 10**9


@pytest.fixture(params=["bag", "folder"])
def bag(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A second of driving, in the manner of ROS 1 and of ROS 2."""
    path = tmp_path / ("drive.bag" if request.param == "bag" else "drive")
    with BagWriter(path) as writer:
        writer.write_static_transform(np.array([0.3, 0.0, 0.0]))
        for i in range(SCANS):
            stamp = 10**18 + i * PERIOD
            pose = np.array([0.1 * i, 0.0, 0.0])
            writer.write_odometry(Odometry(stamp, pose, np.array([2.0, 0.0, 0.0])))
            writer.write_scan(stamp, np.full(100, i, dtype=np.float32), -1.0, 0.02, 0.0, 0.025, 0.1, 30.0)
    return path


@pytest.fixture
def bus() -> Iterator[Any]:
    from tests.pipelines.live.bus import ros_bus

    with ros_bus() as bus:
        yield bus


def test_messages_come_in_order_and_in_time(bus: Any, bag: Path) -> None:
    from nav_msgs.msg import Odometry as OdometryMessage
    from rosgraph_msgs.msg import Clock
    from sensor_msgs.msg import LaserScan

    from racecar.pipelines.live.player import Player

    scans: list[tuple[float, Any]] = []
    samples: list[Any] = []
    clocks: list[int] = []
    node = bus.node("test_listener")
    node.create_subscription(LaserScan, "/scan", lambda m: scans.append((time.monotonic(), m)), 100)
    node.create_subscription(OdometryMessage, "/odom", samples.append, 100)
    node.create_subscription(Clock, "/clock", lambda m: clocks.append(nanoseconds(m.clock)), 100)
    player = Player(bus.node("test_player"), bag)
    player.publish_clock()
    assert player.wait_for_listeners(10.0, listeners=1)
    played = player.play(2.0)
    wait_for(lambda: len(scans) == SCANS and len(samples) == SCANS, lambda: f"{len(scans)}", 5.0)
    player.close()
    assert (played.messages, played.scans) == (2 * SCANS + 1, SCANS)
    assert [message.ranges[0] for _, message in scans] == list(range(SCANS))
    assert [nanoseconds(m.header.stamp) for m in samples] == [10**18 + i * PERIOD for i in range(SCANS)]
    assert samples[-1].pose.pose.position.x == pytest.approx(1.9)
    assert scans[-1][0] - scans[0][0] == pytest.approx((SCANS - 1) * PERIOD * 1e-9 / 2.0, rel=0.1)
    assert clocks == sorted(clocks)
    assert len(clocks) >= SCANS - 1


@pytest.mark.parametrize("listeners", [None, 2])
def test_a_listener_who_is_found_a_little_later_is_waited_for(
    bus: Any, bag: Path, listeners: int | None
) -> None:
    from sensor_msgs.msg import LaserScan

    from racecar.pipelines.live.player import Player

    node = bus.node("test_listener")

    def listen() -> None:
        node.create_subscription(LaserScan, "/scan", lambda message: None, 100)

    listen()
    bus.at(bus.monotonic + SECOND // 2, listen)
    player = Player(bus.node("test_player"), bag)
    assert player.wait_for_listeners(10.0, listeners)
    assert node.count_subscribers("/scan") == 2
    player.close()


@pytest.mark.parametrize("listeners", [None, 1])
def test_nobody_is_waited_for_in_vain(bus: Any, bag: Path, listeners: int | None) -> None:
    from racecar.pipelines.live.player import Player

    player = Player(bus.node("test_player"), bag)
    assert not player.wait_for_listeners(0.2, listeners)
    player.close()


def test_a_topic_that_is_not_there_is_named(bus: Any, bag: Path) -> None:
    from racecar.pipelines.live.player import Player

    with pytest.raises(UserError, match="no topic /skan"):
        Player(bus.node("test_player"), bag, ["/skan"])


def write_paused_drive(path: Path) -> None:
    """Half a minute of driving, with a pause of 40 s in its middle in which nothing was recorded."""
    first, laser = recorded()[0][0], UST_10LX
    with BagWriter(path) as writer:
        writer.write_static_transform(BASE_FROM_LASER)
        for due, said, _ in recorded():
            if due > first + 30 * SECOND:
                break
            shift = 40 * SECOND if due > first + 15 * SECOND else 0
            if isinstance(said, Scan):
                shape = (laser.angle_min, laser.angle_increment, laser.time_increment, laser.scan_time)
                ranges = said.ranges.astype(np.float32)
                writer.write_scan(said.stamp + shift, ranges, *shape, laser.range_min, laser.range_max)
            else:
                writer.write_odometry(replace(said[0], stamp=said[0].stamp + shift))


def test_a_paused_drive_at_ten_times_the_speed_sets_no_clock(tmp_path: Path) -> None:
    """A bag that is played fast is taken for what it is: no clock is said to be set, or to disagree."""
    from racecar.pipelines.live.player import Player

    write_paused_drive(tmp_path / "drive.bag")
    with car_stage() as stage:
        stage.localize(tmp_path, initial_pose=recorded()[0][2])
        player = Player(stage.bus.node("test_player"), tmp_path / "drive.bag")
        player.play(10.0)
        player.close()
        assert len(stage.poses) > 1000
        assert [line for line in stage.bus.log if "stamp" in line or "clock" in line] == []


def test_no_module_is_imported_because_a_bag_names_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from racecar.pipelines.live.ros.message_types import message_class

    (tmp_path / "evil").mkdir()
    (tmp_path / "evil" / "__init__.py").write_text("raise SystemExit('imported')")
    (tmp_path / "evil" / "msg.py").write_text("Bad = 1")
    monkeypatch.syspath_prepend(str(tmp_path))
    for name in ("evil/msg/Bad", "os/msg/path", "../evil/msg/Bad", "sensor_msgs/msg/Nothing", ""):
        assert message_class(name) is None
    assert message_class("sensor_msgs/msg/LaserScan") is not None
