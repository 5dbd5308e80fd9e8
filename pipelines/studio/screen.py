"""A screen of the studio: what the page is used for at the moment, and what clicks on the floor mean."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray


class Tool:
    """Does something where one clicks; a drag moves the map. Its methods are called by the studio's worker,
    but for `takes_drag`."""

    def __init__(
        self, name: str, help: str, take: Callable[[NDArray[np.float64]], None] | None = None
    ) -> None:
        """``help``: a sentence for the side panel; ``take`` is given the places (2,) that are clicked."""
        self.name, self.help, self._take = name, help, take

    def click(self, place: NDArray[np.float64]) -> None:
        """A place (2,) of the floor was clicked."""
        if self._take is not None:
            self._take(place)

    def takes_drag(self, start: NDArray[np.float64]) -> bool:
        """Whether a drag from a place (2,) means something; else it moves the map. May be asked by any
        thread."""
        return False

    def drag(self, start: NDArray[np.float64], end: NDArray[np.float64], *, is_over: bool) -> None:
        """The pointer was dragged from one place (2,) to another, which `takes_drag`."""


class Screen:
    """Is made by the studio's worker when it is entered, on a page that is empty, and draws what does not
    change. The worker calls all methods, one after the other; a screen has those of which it has need."""

    @property
    def tool(self) -> Tool:
        """What clicks and drags on the floor mean at the moment. May be asked by any thread."""
        return _MOVE

    @property
    def would_be_lost(self) -> str:
        """What is lost when the screen is left now, and how to keep it, in a sentence; empty: nothing."""
        return ""

    def step(self, seconds: float) -> None:
        """Go on by some seconds."""

    def draw(self) -> None:
        """Draw what has changed, as often as the pages can show it."""

    def close(self) -> None:
        """The screen is left."""


_MOVE = Tool("Only move the map", "Drag to move, wheel to zoom.")
