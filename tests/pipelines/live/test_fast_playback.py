"""A bag that is played fast is taken for what it is: no clock is said to be set, or to disagree."""

import os
import time
from dataclasses import replace
from pathlib import Path

from racecar.maps.map_files import save_map
from racecar.pipelines.bags.writer import BagWriter
from racecar.pipelines.simulation.laser_models import BASE_FROM_LASER, UST_10LX
from racecar.pipelines.simulation.simulator import LaserSweep
from tests.pipelines.live.live_car import recorded, ring, wait_for

SECOND = 1_000_000_000
SPEED, PAUSED_AFTER, PAUSE, END = 10.0, 15 * SECOND, 40 * SECOND, 30 * SECOND


def write_paused_drive(path: Path) -> None:
    """Half a minute of driving, with a pause in its middle in which nothing was recorded."""
    first = recorded()[0][0]
    with BagWriter(path) as writer:
        writer.write_static_transform(BASE_FROM_LASER)
        for due, said, _ in recorded():
            if due > first + END:
                break
            shift = PAUSE if due > first + PAUSED_AFTER else 0
            if isinstance(said, LaserSweep):
                writer.write_scan(
                    said.stamp + shift,
                    said.ranges,
                    UST_10LX.angle_min,
                    UST_10LX.angle_increment,
                    UST_10LX.time_increment,
                    UST_10LX.scan_time,
                    UST_10LX.range_min,
                    UST_10LX.range_max,
                )
            else:
                writer.write_odometry(replace(said[0], stamp=said[0].stamp + shift))


def test_a_paused_drive_at_ten_times_the_speed_sets_no_clock(tmp_path: Path) -> None:
    from geometry_msgs.msg import PoseWithCovarianceStamped

    from racecar.pipelines.live.player import Player
    from racecar.pipelines.live.ros.processes import private_environment, racecar_process
    from racecar.pipelines.live.ros.run import ros_node, served

    save_map(ring(), tmp_path / "map.yaml")
    write_paused_drive(tmp_path / "drive.bag")
    log, poses = tmp_path / "log", []
    command = ["live", "localize", "--map", str(tmp_path), "--no-memory", "--initial-pose"]
    command += [str(number) for number in recorded()[0][2]]
    environment = private_environment(int(os.environ["ROS_DOMAIN_ID"]))
    with ros_node("test_player", []) as node:
        node.create_subscription(PoseWithCovarianceStamped, "/amcl_pose", poses.append, 100)
        player = Player(node, tmp_path / "drive.bag")
        with served(node), racecar_process(command, environment, log):
            assert player.wait_for_listeners(60.0, listeners=1), log.read_text()
            player.play(SPEED)
            wait_for(lambda: len(poses) > 100, 10.0, log.read_text)
            time.sleep(1.0)
        player.close()
    assert [line for line in log.read_text().splitlines() if "stamp" in line or "clock" in line] == []
