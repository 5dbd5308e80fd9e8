"""A node that was killed while the car drove begins where the car is now, and knows its laser."""

import os
from pathlib import Path

from racecar.maps.map_files import save_map
from tests.pipelines.live.live_car import LiveCar, Witness, recorded, ring, wait_for


def test_a_node_killed_mid_drive_is_right_two_seconds_after_its_first_scan(tmp_path: Path) -> None:
    from racecar.pipelines.live.ros.processes import private_environment, racecar_process
    from racecar.pipelines.live.ros.run import ros_node, served

    log = tmp_path / "log"
    log.touch()
    save_map(ring(), tmp_path / "map.yaml")
    x, y, yaw = recorded()[0][2]
    begin = ["live", "localize", "--map", str(tmp_path), "--memory", str(tmp_path / "memory")]
    environment = private_environment(int(os.environ["ROS_DOMAIN_ID"]))
    with ros_node("test_car", []) as node, served(node):
        car = LiveCar(node)
        witness = Witness(car, log)
        witness.listen(node)
        first = [*begin, "--initial-pose", str(x), str(y), str(yaw)]
        with racecar_process(first, environment, log) as process:
            wait_for(lambda: bool(node.count_subscribers("/scan")), 60.0, witness.said)
            with car.driving():
                wait_for(lambda: remembers_laser(tmp_path / "memory"), 20.0, witness.said)
                witness.seconds_until_right(4.0)
                process.kill()
                process.wait()
                car.hush_place()
                witness.odometry.clear()
                with racecar_process(begin, environment, log) as again:
                    wait_for(lambda: bool(witness.odometry) or again.poll() is not None, 60.0, witness.said)
                    witness.seconds_until_right(2.0)
                    assert again.poll() is None
    said = log.read_text()
    assert "on the whole map" not in said
    assert "where it was in the last run" in said


def remembers_laser(memory: Path) -> bool:
    return any("laser_frame" in path.read_text() for path in memory.glob("pose-*.json"))
