"""Samples of a gyroscope."""

from dataclasses import dataclass


@dataclass(frozen=True, eq=False)
class YawRate:
    """One reading of how fast the car turns."""

    stamp: int
    """Nanoseconds."""
    rate: float
    """Radians per second about the base's z axis, counter-clockwise, as measured."""
