"""The tool for drawing shapes, by clicking and dragging their corners."""

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

    def __init__(
        self, page: Page, draft: Draft, finish: Callable[[], None], changed: Callable[[], None]
    ) -> None:
        """``finish`` makes an edit from the corners; ``changed`` is called when they have changed."""
        super().__init__("Draw", "")
        self._page, self._draft, self._finish, self._changed = page, draft, finish, changed
        self.kind: EditKind = "erase"
        """Kind of the shape being drawn."""

    def explain(self) -> str:
        """How to draw a shape of this kind."""
        end = "the last corner again" if self.kind == "wall" else "the first corner again"
        return f"{HELP[self.kind]} Click the corners, then {end}; drag a corner to move it."

    def click(self, place: NDArray[np.float64]) -> None:
        """Add a corner; a click on the first one closes a shape, a click on the last one ends a wall."""
        corners, corner = self._draft.corners, self._corner_at(place)
        if corner is not None and corner == (len(corners) - 1 if self.kind == "wall" else 0):
            self._finish()
            return
        self._draft.add_corner(place if corner is None else corners[corner])
        self.draw()

    def takes_drag(self, start: NDArray[np.float64]) -> bool:
        """Whether a drag moves a corner of the shape being drawn; elsewhere it moves the map."""
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
        """Draw the unfinished shape, which has changed."""
        self._show(self._draft.corners)
        self._changed()

    def _show(self, corners: NDArray[np.float64]) -> None:
        self._page.layers.line("drawn", corners)
        self._page.layers.dots("corners", corners)

    def _corner_at(self, place: NDArray[np.float64]) -> int | None:
        """Index of the corner at a place (2,), or None."""
        corners = self._draft.corners
        if not len(corners):
            return None
        distances = np.hypot(*(corners - place).T)
        nearest = int(np.argmin(distances))
        return nearest if distances[nearest] < self._page.view.finger else None
