"""What clicks and drags on the floor mean: chosen from a list in the side panel."""

from collections.abc import Mapping
from enum import Enum
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from racecar.pipelines.studio.outlines import arrow
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.palette import LOOP
from racecar.pipelines.studio.pointed import Pointed, pointed

ToolT = TypeVar("ToolT", bound=Enum)


class Pointer(Generic[ToolT]):
    """A list of tools with a sentence on the chosen one, and the arrow of a drag while it lasts."""

    def __init__(self, page: Page, tools: Mapping[ToolT, str]) -> None:
        """Tools, named by their values, with their sentences; the first is chosen. Called inside the folder
        of the panel in which they are to be seen."""
        self._page, self._tools = page, tools
        self.tool = next(iter(tools))
        """The one that is chosen."""
        page.on_change(page.gui.add_dropdown("Tool", [tool.value for tool in tools]), self._choose)
        self._help = page.gui.add_markdown(tools[self.tool])

    def click(self, place: NDArray[np.float64]) -> Pointed:
        """What a click at a place (2,) shows."""
        return pointed(place, place, self._page.view.finger)

    def drag(self, start: NDArray[np.float64], end: NDArray[np.float64], *, is_over: bool) -> Pointed | None:
        """Draw a drag from one place (2,) to another; once it is over, what it has shown."""
        finger, layers = self._page.view.finger, self._page.layers
        if is_over:
            layers.clear("drag")
            return pointed(start, end, finger)
        layers.segments("drag", arrow(start, end, finger), LOOP, 4.0)
        return None

    def _choose(self, name: str) -> None:
        self.tool = next(tool for tool in self._tools if tool.value == name)
        self._help.content = self._tools[self.tool]
