"""A simulated car and a node with its page, in one process and over DDS, in a namespace of their own."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from html import unescape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.live.display.browser_view import LiveView, live_view
from racecar.pipelines.simulation.driven_simulation import Conditions, DrivenSimulation
from racecar.pipelines.simulation.simulator_config import NoiseLevel
from racecar.pipelines.studio.watch.tools import NodeTool
from tests.pipelines.live.live_car import wait_for
from tests.pipelines.simulation.test_driven_simulation import GRID

START = np.array([2.0, 2.0, 0.0])
NAMESPACE = "/car1"


@dataclass
class Clicker:
    """Somebody at the page."""

    view: LiveView

    def choose(self, tool: NodeTool) -> None:
        self._ask(lambda: self.room._pointer._choose(tool.value))

    def click(self, place: NDArray[np.float64]) -> None:
        self._ask(lambda: self.room.click(place))

    def drag(self, start: NDArray[np.float64], end: NDArray[np.float64]) -> None:
        self._ask(lambda: self.room.drag(start, end, is_over=False))
        self._ask(lambda: self.room.drag(start, end, is_over=True))

    @property
    def room(self) -> Any:
        return self.view._room

    def await_words(self, words: str, within: float = 10.0) -> None:
        """Until they are read in the panel: how the node is, or what became of a click."""
        panel = self.room._state, self.room._outcome
        wait_for(
            lambda: any(words in unescape(part.content) for part in panel),
            within,
            lambda: str([part.content for part in panel]),
        )

    def await_car(self, within: float = 20.0) -> None:
        """Until map and car are shown."""
        wait_for(
            lambda: self.room._watched.grid is not None and self.room._watched.glimpse is not None,
            within,
            self.said,
        )

    def said(self) -> str:
        return f"{self.room._state.content} {self.room._outcome.content}"

    def _ask(self, request: Any) -> None:
        """As what is done on a page in a browser comes: by the page's own thread."""
        self.view._page.request(request)


@contextmanager
def simulated_car() -> Iterator[DrivenSimulation]:
    """Drives on its own, while the block lasts; the ROS of this process must run."""
    import rclpy

    from racecar.pipelines.live.ros.run import served
    from racecar.pipelines.live.simulator_node import SimulatorNode

    simulation = DrivenSimulation(GRID, Conditions(noise=NoiseLevel.SLIGHT), start=START)
    node = rclpy.create_node("racecar_simulator")
    try:
        SimulatorNode(node, simulation, pace=1.0, teleports=False).start()
        with served(node):
            yield simulation
    finally:
        node.destroy_node()


@contextmanager
def page_and_node(name: str, tools: list[NodeTool]) -> Iterator[tuple[Clicker, Any]]:
    """A page, and a ROS node for what is to fill it."""
    from racecar.pipelines.live.ros.run import ros_node

    in_namespace = ["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", "base_frame:=car1/base_link"]
    with live_view(name, None, tools) as view, ros_node(name, in_namespace) as node:
        yield Clicker(view), node


def distance(pose: Pose, place: NDArray[np.float64]) -> float:
    """Metres."""
    return float(np.linalg.norm(pose[:2] - place[:2]))
