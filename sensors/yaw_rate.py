"""Gyroscope samples."""

from dataclasses import dataclass

from racecar.maps.calls import checked


@checked
@dataclass(frozen=True, eq=False)
class YawRate:
    """One gyroscope reading."""

    stamp: int
    """Nanoseconds."""
    rate: float
    """Radians per second about the base's z axis, counter-clockwise, uncorrected."""
