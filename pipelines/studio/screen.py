"""A screen of the studio: what the page currently shows, and what clicks on the floor mean."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray


class Tool:
    """Handles clicks; drags move the map. The studio's worker calls its methods, except for `takes_drag`."""

    def __init__(
        self, name: str, help: str, take: Callable[[NDArray[np.float64]], None] | None = None
    ) -> None:
        """``help`` is a sentence for the side panel; ``take`` receives the clicked places (2,)."""
        self.name, self.help, self._take = name, help, take

    def click(self, place: NDArray[np.float64]) -> None:
        """Handle a click on a place (2,) of the floor."""
        if self._take is not None:
            self._take(place)

    def takes_drag(self, start: NDArray[np.float64]) -> bool:
        """Whether a drag from a place (2,) is handled; otherwise it moves the map. Callable from any
        thread."""
        return False

    def drag(self, start: NDArray[np.float64], end: NDArray[np.float64], *, is_over: bool) -> None:
        """Handle a drag from one place (2,) to another, if `takes_drag`."""


class Screen:
    """The studio's worker creates a screen on an empty page when it is entered, and calls all its methods one
    after the other. The constructor draws what does not change; subclasses override the methods they need."""

    @property
    def tool(self) -> Tool:
        """What clicks and drags on the floor currently mean. Callable from any thread."""
        return _MOVE

    @property
    def would_be_lost(self) -> str:
        """What is lost if the screen is left now, and how to keep it, in a sentence; empty if nothing."""
        return ""

    def rescue(self) -> str:
        """Save what would be lost and need not be asked about, as the studio ends; returns where, in a
        sentence, empty if nothing. Raises UserError when that fails."""
        return ""

    def step(self, seconds: float) -> None:
        """Advance by some seconds."""

    def draw(self) -> bool:
        """Draw what has changed, as often as the pages can show it; returns whether anything has."""
        return False

    def close(self) -> None:
        """Clean up when the screen is left."""


_MOVE = Tool("Only move the map", "Drag to move, wheel to zoom.")
