"""Size of the map so far."""

from typing import NamedTuple


class Growth(NamedTuple):
    """Counts for a drive in progress."""

    keyframes: int = 0
    submaps: int = 0
    loops: int = 0
    """Closed loops."""
    metres: float = 0.0
    """Path length in metres."""
