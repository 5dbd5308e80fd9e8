"""The screen for watching what a node sees, and for sending the car to a goal by clicks."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.files.literal_markdown import literal
from racecar.pipelines.runs.view.headline import Headline
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.pointed import Pointed
from racecar.pipelines.studio.screen import Screen, Tool
from racecar.pipelines.studio.tools import PoseTool, ToolChoice
from racecar.pipelines.studio.watch.goal import Goal, goal_pose
from racecar.pipelines.studio.watched_car import Glimpse, WatchedCar

MOVE, GOAL, PLACE = "Only move the map", "2D Goal Pose", "2D Pose Estimate"
"""The tools, as the panel names them."""
_MOST_PARTICLES = 500
"""Maximum particles sent; more would only hide each other."""


class WatchScreen(Screen):
    """The latest state of a node, and where clicks go. A node may call its methods from any thread."""

    def __init__(self, page: Page, *, tells_places: bool) -> None:
        """``tells_places`` sets whether clicks may set the car's pose."""
        self._page = page
        self._send_goal: Callable[[Pose], str] | None = None
        self._send_place: Callable[[Pointed], str] | None = None
        self._goal: Goal | None = None
        tools = [
            Tool(MOVE, "Drag to move, wheel to zoom. Nothing is sent."),
            PoseTool(
                page,
                GOAL,
                "Click where the car shall go, or drag from there to where it shall look.",
                lambda shown: self._tell_outcome(self._set_goal, shown),
            ),
            PoseTool(
                page,
                PLACE,
                "Drag from where the car is to where it looks. A click leaves the heading open.",
                lambda shown: self._tell_outcome(self._set_place, shown),
            ),
        ]
        with page.folder("State"):
            self._state = page.gui.add_markdown("")
        page.frame.head(Headline("The node is starting"))
        with page.folder("What a click means"):
            self.tools = ToolChoice(page, *(tools if tells_places else tools[:2]))
            self._outcome = page.gui.add_markdown("")
            self._way = page.gui.add_markdown("")
        self.watched = WatchedCar(page, follows=True)

    @property
    def tool(self) -> Tool:
        """The selected tool."""
        return self.tools.tool

    def connect(
        self, send_goal: Callable[[Pose], str], send_place: Callable[[Pointed], str] | None = None
    ) -> None:
        """Send clicks to these functions from now on: goals ``map_from_goal`` (3,), and places of the car.
        Each returns a sentence that names the receiver; raises UserError when there is none."""

        def connect() -> None:
            self._send_goal, self._send_place = send_goal, send_place

        self._page.request(connect)

    def tell(self, headline: Headline, words: str) -> None:
        """Show the state of the node: a headline, and words in Markdown."""

        def tell() -> None:
            self._page.frame.head(headline)
            self._state.content = words

        self._page.request(tell)

    def show_map(self, grid: OccupancyGrid) -> None:
        """Show a new map."""
        self._page.request(lambda: self.watched.take(grid))

    def show(
        self,
        map_from_base: Pose,
        scan_in_map: NDArray[np.float64],
        path: Pose,
        particles: Pose | None = None,
    ) -> None:
        """Show the car (3,), its scan (N, 2), the path driven (M, 3), and particles (P, 3)."""
        if particles is not None:
            particles = particles[:: -(-len(particles) // _MOST_PARTICLES)]
        glimpse = Glimpse(map_from_base, scan_in_map, path.copy(), particles)
        self._page.request(lambda: self._take(glimpse))

    def draw(self) -> bool:
        """Draw the latest state, and the goal at a clearly visible size."""
        has_changed = self.watched.draw()
        if self._goal is not None:
            self._page.layers.segments("goal", self._goal.drawing(self._page.view.finger))
            if self._goal.is_reached:
                self._goal = None
        return has_changed

    def _take(self, glimpse: Glimpse) -> None:
        self.watched.take(glimpse)
        if self._goal is not None:
            self._way.content = self._goal.follow(glimpse.map_from_base)

    def _tell_outcome(self, send: Callable[[Pointed], str], shown: Pointed) -> None:
        """Send the indicated place or pose, and show the outcome."""
        try:
            if self.watched.grid is None:
                raise UserError("There is no map yet to click on: wait until it is seen.")
            self._outcome.content = literal(send(shown))
        except UserError as error:
            self._outcome.content = literal(str(error))
            raise

    def _set_goal(self, shown: Pointed) -> str:
        glimpse = self.watched.glimpse
        map_from_goal = goal_pose(shown, None if glimpse is None else glimpse.map_from_base)
        assert self._send_goal is not None  # there is only a map once a node is connected
        words = self._send_goal(map_from_goal)
        self._goal, self._way.content = Goal(map_from_goal), ""
        return words

    def _set_place(self, shown: Pointed) -> str:
        assert self._send_place is not None
        return self._send_place(shown)
