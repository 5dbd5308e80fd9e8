"""Tools for indicating poses, and a list to choose a tool from."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from racecar.pipelines.studio.outlines import arrow
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.pointed import Pointed, pointed
from racecar.pipelines.studio.screen import Tool


class PoseTool(Tool):
    """A drag indicates a place and a direction, a click only a place."""

    def __init__(self, page: Page, name: str, help: str, take_pose: Callable[[Pointed], None]) -> None:
        super().__init__(name, help)
        self._page, self._take_pose = page, take_pose

    def click(self, place: NDArray[np.float64]) -> None:
        """Handle a place, with the precision of a finger."""
        self._take_pose(pointed(place, place, self._page.view.finger))

    def takes_drag(self, start: NDArray[np.float64]) -> bool:
        """True for every place."""
        return True

    def drag(self, start: NDArray[np.float64], end: NDArray[np.float64], *, is_over: bool) -> None:
        """Draw an arrow during the drag, and handle the result at its end."""
        finger, layers = self._page.view.finger, self._page.layers
        if is_over:
            layers.clear("drag")
            self._take_pose(pointed(start, end, finger))
        else:
            layers.segments("drag", arrow(start, end, finger))


class ToolChoice:
    """A list of tools in the side panel, with the help of the selected one."""

    def __init__(self, page: Page, *tools: Tool) -> None:
        """The first tool is selected. Call this inside the panel's folder that should contain the list."""
        self._tools = {tool.name: tool for tool in tools}
        self.tool = tools[0]
        """The selected tool."""
        page.on_change(page.gui.add_dropdown("Tool", list(self._tools)), self.choose)
        self._help = page.gui.add_markdown(self.tool.help)

    def choose(self, name: str) -> None:
        """Select another tool."""
        self.tool = self._tools[name]
        self._help.content = self.tool.help
