"""How much is mapped."""

from typing import NamedTuple


class Growth(NamedTuple):
    """Of a drive so far."""

    keyframes: int = 0
    submaps: int = 0
    loops: int = 0
    """Closed ones."""
    metres: float = 0.0
    """Driven."""
