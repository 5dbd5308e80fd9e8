"""A simulated car and a node with its page, in a namespace of their own, and who clicks there."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from html import unescape
from threading import Event
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.pipelines.simulation.driven_simulation import Conditions, DrivenSimulation
from racecar.pipelines.simulation.simulator_config import NoiseLevel
from racecar.pipelines.studio.page import Page, open_beside
from racecar.pipelines.studio.watch.watch_screen import WatchScreen
from tests.pipelines.live.stage import wait_for
from tests.pipelines.simulation.test_driven_simulation import GRID

if TYPE_CHECKING:
    from tests.pipelines.live.bus import Bus, BusNode

START = np.array([2.0, 2.0, 0.0])
_IN_NAMESPACE = ("-r", "__ns:=/car1")


@dataclass
class PageStage:
    """The node under test, its page, and the car."""

    bus: "Bus"
    page: Page
    view: WatchScreen
    live: Any
    car: DrivenSimulation

    def choose(self, tool: str) -> None:
        self._ask(lambda: self.view.tools.choose(tool))

    def click(self, place: NDArray[np.float64]) -> None:
        self._ask(lambda: self.view.tool.click(place))

    def drag(self, start: NDArray[np.float64], end: NDArray[np.float64]) -> None:
        self._ask(lambda: self.view.tool.drag(start, end, is_over=False))
        self._ask(lambda: self.view.tool.drag(start, end, is_over=True))

    def await_words(self, words: str) -> None:
        """Until they are read in the panel: how the node is, or what became of a click."""
        wait_for(lambda: words in self.said(), self.said, 10.0)

    def said(self) -> str:
        self._ask(lambda: None)
        heading = self.page.frame._headline.content
        return unescape(f"{heading} {self.view._state.content} {self.view._outcome.content}")

    def start_car(self) -> None:
        """It drives on its own from now on; waits until it is shown on the map."""
        from racecar.pipelines.live.simulator_node import SimulatorNode

        node = self.bus.node("racecar_simulator", *_IN_NAMESPACE)
        SimulatorNode(node, self.car, pace=1.0, teleports=False).start()
        watched = self.view.watched
        wait_for(
            lambda: bool(self.said()) and watched.grid is not None and watched.glimpse is not None,
            self.said,
            20.0,
        )

    def _ask(self, request: Any) -> None:
        """As what is done on a page in a browser comes: by the page's own thread, which all is waited for."""
        done = Event()
        self.page.request(request)
        self.page.request(done.set)
        assert done.wait(60.0)


@contextmanager
def page_stage(
    name: str, make: Callable[["BusNode", WatchScreen], Any], *, tells_places: bool
) -> Iterator[PageStage]:
    """A page and the node that fills it, which is not started yet; the car stands still."""
    from tests.pipelines.live.bus import ros_bus

    car = DrivenSimulation(GRID, Conditions(noise=NoiseLevel.SLIGHT), start=START)
    make_screen = partial(WatchScreen, tells_places=tells_places)
    with ros_bus() as bus, open_beside(name, 0, make_screen) as (page, view):
        node = bus.node(name, *_IN_NAMESPACE, "-p", "base_frame:=car1/base_link")
        yield PageStage(bus, page, view, make(node, view), car)


def distance(pose: Pose, place: NDArray[np.float64]) -> float:
    """Metres."""
    return float(np.linalg.norm(pose[:2] - place[:2]))
