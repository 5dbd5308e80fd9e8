"""A bag is played as it was recorded."""

import time
from pathlib import Path
from threading import Timer
from typing import Any

import numpy as np
import pytest

from racecar.maps.errors import UserError
from racecar.pipelines.bags.messages import nanoseconds
from racecar.pipelines.bags.writer import BagWriter
from racecar.sensors.odometry import Odometry
from tests.pipelines.live.live_car import wait_for

SCANS, PERIOD = 20, 50_000_000


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


def test_messages_come_in_order_and_in_time(bag: Path) -> None:
    from nav_msgs.msg import Odometry as OdometryMessage
    from rosgraph_msgs.msg import Clock
    from sensor_msgs.msg import LaserScan

    from racecar.pipelines.live.player import Player
    from racecar.pipelines.live.ros.run import ros_node, served

    scans: list[tuple[float, Any]] = []
    samples: list[Any] = []
    clocks: list[int] = []
    with ros_node("test_listener", []) as node, ros_node_of_player() as player_node:
        node.create_subscription(LaserScan, "/scan", lambda m: scans.append((time.monotonic(), m)), 100)
        node.create_subscription(OdometryMessage, "/odom", samples.append, 100)
        node.create_subscription(Clock, "/clock", lambda m: clocks.append(nanoseconds(m.clock)), 100)
        player = Player(player_node, bag)
        player.publish_clock()
        with served(node):
            assert player.wait_for_listeners(10.0, listeners=1)
            wait_for(lambda: bool(player_node.count_subscribers("/clock")), 5.0, lambda: "no clock")
            time.sleep(0.3)
            played = player.play(2.0)
            wait_for(lambda: len(scans) == SCANS and len(samples) == SCANS, 5.0, lambda: f"{len(scans)}")
        player.close()
    assert (played.messages, played.scans) == (2 * SCANS + 1, SCANS)
    assert [message.ranges[0] for _, message in scans] == list(range(SCANS))
    assert [nanoseconds(m.header.stamp) for m in samples] == [10**18 + i * PERIOD for i in range(SCANS)]
    assert samples[-1].pose.pose.position.x == pytest.approx(1.9)
    assert scans[-1][0] - scans[0][0] > 0.5 * (SCANS - 1) * PERIOD * 1e-9 / 2.0  # not all at once
    assert clocks == sorted(clocks)
    assert len(clocks) >= SCANS - 1


@pytest.mark.parametrize("listeners", [None, 2])
def test_a_listener_who_is_found_a_little_later_is_waited_for(bag: Path, listeners: int | None) -> None:
    from sensor_msgs.msg import LaserScan

    from racecar.pipelines.live.player import Player
    from racecar.pipelines.live.ros.run import ros_node

    with ros_node("test_listener", []) as node, ros_node_of_player() as player_node:
        node.create_subscription(LaserScan, "/scan", lambda message: None, 100)
        player = Player(player_node, bag)
        late = Timer(0.5, lambda: node.create_subscription(LaserScan, "/scan", lambda message: None, 100))
        late.start()
        assert player.wait_for_listeners(10.0, listeners)
        assert player_node.count_subscribers("/scan") == 2
        late.join()
        player.close()


@pytest.mark.parametrize("listeners", [None, 1])
def test_nobody_is_waited_for_in_vain(bag: Path, listeners: int | None) -> None:
    from racecar.pipelines.live.player import Player
    from racecar.pipelines.live.ros.run import ros_node

    with ros_node("test_player", []) as node:
        player = Player(node, bag)
        assert not player.wait_for_listeners(0.2, listeners)
        player.close()


def ros_node_of_player() -> Any:
    from contextlib import contextmanager

    import rclpy

    @contextmanager
    def made() -> Any:
        node = rclpy.create_node("test_player")
        yield node
        node.destroy_node()

    return made()


def test_a_topic_that_is_not_there_is_named(bag: Path) -> None:
    from racecar.pipelines.live.player import Player
    from racecar.pipelines.live.ros.run import ros_node

    with ros_node("test_player", []) as node, pytest.raises(UserError, match="no topic /skan"):
        Player(node, bag, ["/skan"])


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
