"""A localizer's node in a process of its own, and a simulated car that drives for it."""

import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecar.maps.grid.occupancy_grid import OccupancyGrid
from tests.pipelines.live.live_car import LiveCar, Witness, recorded, ring, wait_for

RIGHT_AGAIN = 2.0
"""Seconds of good input."""


@dataclass
class Stage:
    """The node under test, the car, and who listens."""

    node: Any
    car: LiveCar
    witness: Witness
    log: Path
    memory: Path
    process: Any = None
    options: Sequence[str] = ()

    def publisher(self, kind: Any, topic: str, qos: Any = 10) -> Any:
        publisher = self.node.create_publisher(kind, topic, qos)
        wait_for(lambda: bool(publisher.get_subscription_count()), 5.0, lambda: f"nobody listens to {topic}")
        return publisher

    def arguments(self) -> list[str]:
        x, y, yaw = recorded()[0][2]
        start = ["--initial-pose", str(x), str(y), str(yaw)]
        return ["live", "localize", "--memory", str(self.memory), *start, *self.options]


@contextmanager
def localizer_stage(
    folder: Path, prepare: Callable[[LiveCar], None] = lambda car: None, options: Sequence[str] = ()
) -> Iterator[Stage]:
    """The node runs with further options, and the car, which is prepared before, drives while the block
    lasts."""
    from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage

    from racecar.pipelines.live.ros.processes import private_environment, racecar_process
    from racecar.pipelines.live.ros.qos import LATCHED
    from racecar.pipelines.live.ros.run import ros_node, served

    log, memory = folder / "log", folder / "memory"
    log.touch()
    recorded()
    with ros_node("test_car", []) as node:
        car = LiveCar(node)
        stage = Stage(node, car, Witness(car, log), log, memory, options=options)
        prepare(car)
        stage.witness.listen(node)
        map_topic = node.create_publisher(OccupancyGridMessage, "/map", LATCHED)
        map_topic.publish(map_message(ring()))
        environment = private_environment(int(os.environ["ROS_DOMAIN_ID"]))
        with served(node), racecar_process(stage.arguments(), environment, log) as process:
            stage.process = process
            wait_for(
                lambda: bool(node.count_subscribers("/scan")) or process.poll() is not None,
                60.0,
                lambda: log.read_text(),
            )
            wait_for(lambda: "The map has arrived" in log.read_text(), 20.0, lambda: log.read_text())
            with car.driving():
                stage.witness.odometry.clear()
                yield stage
            assert process.poll() is None, log.read_text()


def map_message(grid: OccupancyGrid) -> Any:
    from racecar.pipelines.live.ros.messages import grid_message, time_message

    return grid_message(time_message(time.time_ns()), "map", grid)
