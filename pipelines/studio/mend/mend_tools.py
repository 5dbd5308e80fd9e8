"""The tools of the screen: to choose and move passes, and to name two points of walls."""

from collections.abc import Callable
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.mending.manual_constraints import Place
from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.screen import Tool

TwoPlaces: TypeAlias = tuple[Place, Place]


class Move(Protocol):
    """Moves something."""

    def __call__(self, shift: NDArray[np.float64], *, is_over: bool) -> None:
        """By a shift (2,) so far."""


class PassTool(Tool):
    """A click chooses a moment; a drag moves the second pass."""

    def __init__(
        self,
        page: Page,
        second_pass: Callable[[], NDArray[np.float64]],
        choose: Callable[[NDArray[np.float64]], None],
        move: Move,
    ) -> None:
        """``second_pass`` returns its points (N, 2); ``choose`` receives a place (2,); ``move`` a shift (2,),
        and whether the drag is over."""
        super().__init__(
            "Moments and passes",
            "Click two places of the path, for two moments there. Drag the second pass to where it belongs.",
            choose,
        )
        self._page, self._second_pass, self._move = page, second_pass, move

    def takes_drag(self, start: NDArray[np.float64]) -> bool:
        """Whether a drag begins on the second pass."""
        points = self._second_pass()
        return bool(len(points)) and np.hypot(*(points - start).T).min() < self._page.view.finger

    def drag(self, start: NDArray[np.float64], end: NDArray[np.float64], *, is_over: bool) -> None:
        """Move the second pass."""
        self._move(end - start, is_over=is_over)


class WallTool(Tool):
    """Two clicks name two points of walls."""

    def __init__(self, page: Page, name: str, help: str, take: Callable[[TwoPlaces], None]) -> None:
        """``take`` receives both."""
        super().__init__(name, help)
        self._page, self._take_points = page, take
        self._points = np.zeros((0, 2))

    def click(self, place: NDArray[np.float64]) -> None:
        """Name a point; a third one begins again."""
        self._points = np.vstack([self._points if len(self._points) < 2 else np.zeros((0, 2)), place])
        self._page.layers.line("drawn", self._points)
        self._page.layers.dots("corners", self._points)
        if len(self._points) == 2:
            (a, b), (c, d) = self._points.tolist()
            self._take_points(((a, b), (c, d)))
