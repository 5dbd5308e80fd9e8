"""The room in which one watches what a node sees, and sends it somewhere by clicks."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from racecar.maps.errors import UserError
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.files.literal_markdown import literal
from racecar.pipelines.studio.legend import Entry
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.palette import LOOP
from racecar.pipelines.studio.pointed import Pointed
from racecar.pipelines.studio.pointer import Pointer
from racecar.pipelines.studio.room import Room
from racecar.pipelines.studio.watch.goal import Goal, goal_pose
from racecar.pipelines.studio.watch.tools import HELP, NodeTool, Senders
from racecar.pipelines.studio.watched import Glimpse, WatchedMap


class WatchRoom(Room):
    """The latest of a node, and where clicks go."""

    def __init__(self, page: Page, tools: Sequence[NodeTool]) -> None:
        """Of the tools the first is chosen."""
        self._page = page
        self._senders: Senders | None = None
        self._watched = WatchedMap(page)
        self._goal: Goal | None = None
        with page.folder("State"):
            self._state = page.gui.add_markdown("The node is starting.")
        with page.folder("What a click means"):
            self._pointer = Pointer(page, {tool: HELP[tool] for tool in tools})
            self._outcome = page.gui.add_markdown("")
            self._way = page.gui.add_markdown("")
        with page.folder("View"):
            page.on_press(page.gui.add_button("Show the whole map"), self._watched.show_whole)
            self._follows = page.gui.add_checkbox("Follow the car", False)

    def takes_drag(self, start: NDArray[np.float64]) -> bool:
        """A drag moves the map unless a tool is chosen."""
        return self._pointer.tool != NodeTool.MOVE

    def connect(self, senders: Senders) -> None:
        """What is clicked goes there from now on."""
        self._senders = senders

    def tell(self, words: str) -> None:
        """How the node is, from now on, in Markdown."""
        self._state.content = words

    def take_map(self, grid: OccupancyGrid) -> None:
        """The map from now on."""
        self._watched.take_map(grid)

    def take(self, glimpse: Glimpse) -> None:
        """Where the car is now."""
        is_first, self._watched.glimpse = self._watched.glimpse is None, glimpse
        if is_first:
            self._draw_legend()
        if self._goal is not None:
            self._way.content = self._goal.follow(glimpse.map_from_base)

    def draw_all(self) -> None:
        """Draw everything anew."""
        self._watched.draw_anew()
        self._draw_legend()

    def draw(self) -> None:
        """Draw the latest, once."""
        glimpse = self._watched.draw()
        if glimpse is None:
            return
        if self._goal is not None:
            self._draw_goal(self._goal)
        if self._follows.value:
            self._page.view.follow(glimpse.map_from_base[:2])

    def click(self, place: NDArray[np.float64]) -> None:
        """What the tool means."""
        self._take(self._pointer.click(place))

    def drag(self, start: NDArray[np.float64], end: NDArray[np.float64], *, is_over: bool) -> None:
        """A place and a direction."""
        shown = self._pointer.drag(start, end, is_over=is_over)
        if shown is not None:
            self._take(shown)

    def _take(self, shown: Pointed) -> None:
        if self._pointer.tool == NodeTool.MOVE:
            return
        try:
            self._outcome.content = literal(self._send(self._pointer.tool, shown))
        except UserError as error:
            self._outcome.content = literal(str(error))
            raise

    def _send(self, tool: NodeTool, shown: Pointed) -> str:
        """Hand on what was shown; what became of it. Raises UserError when it is too early, or in vain."""
        senders, glimpse = self._senders, self._watched.glimpse
        if senders is None or self._watched.grid is None:
            raise UserError("There is no map yet to click on: wait until it is seen.")
        if tool == NodeTool.PLACE:
            assert senders.place is not None
            return senders.place(shown)
        map_from_goal = goal_pose(shown, None if glimpse is None else glimpse.map_from_base)
        words = senders.goal(map_from_goal)
        self._goal, self._way.content = Goal(map_from_goal), ""
        self._draw_goal(self._goal)
        return words

    def _draw_goal(self, goal: Goal) -> None:
        self._page.layers.segments("goal", goal.drawing(self._page.view.finger), LOOP, 4.0)
        if goal.is_reached:
            self._goal = None

    def _draw_legend(self) -> None:
        self._page.legend.show([*self._watched.entries(), Entry("goal", [LOOP])])
