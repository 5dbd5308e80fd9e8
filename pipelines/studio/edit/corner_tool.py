"""The tool with which shapes are drawn: corners that are clicked and dragged."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from racecar.maps.grid.edits import EditKind
from racecar.pipelines.studio.edit.draft import Draft
from racecar.pipelines.studio.edit.kinds import HELP
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.screen import Tool


class CornerTool(Tool):
    """Draws the corners of a draft."""

    def __init__(self, page: Page, draft: Draft, finish: Callable[[], None]) -> None:
        """``finish`` makes an edit of the corners."""
        super().__init__("Draw", "")
        self._page, self._draft, self._finish = page, draft, finish
        self.kind: EditKind = "erase"
        """Of the shape that is drawn."""

    def explain(self) -> str:
        """How a shape of this kind is drawn."""
        end = "the last corner again" if self.kind == "wall" else "the first corner again"
        return f"{HELP[self.kind]} Click the corners, then {end}; drag a corner to move it."

    def click(self, place: NDArray[np.float64]) -> None:
        """A corner; the first one again closes a shape, the last one again ends a wall."""
        corners, corner = self._draft.corners, self._corner_at(place)
        if corner is not None and corner == (len(corners) - 1 if self.kind == "wall" else 0):
            self._finish()
            return
        self._draft.add_corner(place if corner is None else corners[corner])
        self.draw()

    def takes_drag(self, start: NDArray[np.float64]) -> bool:
        """Corners of the shape that is being drawn are dragged; elsewhere a drag moves the map."""
        return self._corner_at(start) is not None

    def drag(self, start: NDArray[np.float64], end: NDArray[np.float64], *, is_over: bool) -> None:
        """Move a corner."""
        number = self._corner_at(start)
        if number is None:
            return
        if is_over:
            self._draft.move_corner(number, end)
            self.draw()
        else:
            corners = self._draft.corners
            corners[number] = end
            self._show(corners)

    def draw(self) -> None:
        """Draw the shape as it is."""
        self._show(self._draft.corners)

    def _show(self, corners: NDArray[np.float64]) -> None:
        self._page.layers.line("drawn", corners)
        self._page.layers.dots("corners", corners)

    def _corner_at(self, place: NDArray[np.float64]) -> int | None:
        """The number of the corner that is meant by a place (2,), if any is."""
        corners = self._draft.corners
        if not len(corners):
            return None
        distances = np.hypot(*(corners - place).T)
        nearest = int(np.argmin(distances))
        return nearest if distances[nearest] < self._page.view.finger else None
