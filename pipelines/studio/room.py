"""A room of the studio: what the page is used for at the moment."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class Room(Protocol):
    """All methods are called by the studio's worker, one after the other."""

    def draw_all(self) -> None:
        """Draw everything anew: the room was just entered, or the ground has another colour."""

    def step(self, seconds: float) -> None:
        """Go on by some seconds."""

    def draw(self) -> None:
        """Draw what has changed, as often as the pages can show it."""

    def click(self, place: NDArray[np.float64]) -> None:
        """A place (2,) of the floor was clicked."""

    def drag(self, start: NDArray[np.float64], end: NDArray[np.float64], *, is_over: bool) -> None:
        """The pointer was dragged from one place (2,) to another, which `takes_drag`."""

    @property
    def would_be_lost(self) -> str:
        """What is lost when the room is left now, and how to keep it, in a sentence; empty: nothing."""

    def close(self) -> None:
        """The room is left."""

    def takes_drag(self, start: NDArray[np.float64]) -> bool:
        """Whether a drag from a place (2,) means something here; else it moves the map. May be asked by any
        thread."""
