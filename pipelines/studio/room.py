"""A room of the studio: what the page is used for at the moment."""

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray


class Room(ABC):
    """All methods are called by the studio's worker, one after the other; but for drawing, they do nothing
    unless a room does something of its own."""

    @abstractmethod
    def draw_all(self) -> None:
        """Draw everything anew: the room was just entered, or the ground has another colour."""

    def step(self, seconds: float) -> None:  # noqa: B027
        """Go on by some seconds."""

    def draw(self) -> None:  # noqa: B027
        """Draw what has changed, as often as the pages can show it."""

    def click(self, place: NDArray[np.float64]) -> None:  # noqa: B027
        """A place (2,) of the floor was clicked."""

    def takes_drag(self, start: NDArray[np.float64]) -> bool:
        """Whether a drag from a place (2,) means something here; else it moves the map. May be asked by any
        thread."""
        return False

    def drag(self, start: NDArray[np.float64], end: NDArray[np.float64], *, is_over: bool) -> None:  # noqa: B027
        """The pointer was dragged from one place (2,) to another, which `takes_drag`."""

    @property
    def would_be_lost(self) -> str:
        """What is lost when the room is left now, and how to keep it, in a sentence; empty: nothing."""
        return ""

    def close(self) -> None:  # noqa: B027
        """The room is left."""
