"""What a person shows on the floor with a click or a drag."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose

_LEAST_SPREAD, _LEAST_HEADING_SPREAD = 0.1, 0.1
"""Metres and radians: nobody knows better than that where a car stands on a map, however near it is looked
at; by judgement."""


@dataclass(frozen=True, eq=False)
class Pointed:
    """A place, and perhaps a direction, as exact as a finger shows them."""

    place: NDArray[np.float64]
    """(2,) metres in the map."""
    spread: float
    """Standard deviation of the place in metres, the same in every direction."""
    heading: float | None = None
    """Radians in the map; None where no direction was shown."""
    heading_spread: float = math.pi
    """Standard deviation of the heading in radians."""

    def pose(self, otherwise: float) -> Pose:
        """(3,) with another heading where none was shown."""
        return np.array([*self.place, otherwise if self.heading is None else self.heading])


def pointed(start: NDArray[np.float64], end: NDArray[np.float64], finger: float) -> Pointed:
    """What a drag from one place (2,) to another shows, a finger being so many metres wide on the floor: one
    that is shorter is a click, and the longer it is, the better its direction is known."""
    spread = max(finger, _LEAST_SPREAD)
    ahead = end - start
    length = math.hypot(*ahead)
    if length <= finger:
        return Pointed(start, spread)
    both_ends = math.atan2(math.sqrt(2.0) * finger, length)
    return Pointed(start, spread, math.atan2(ahead[1], ahead[0]), max(both_ends, _LEAST_HEADING_SPREAD))
