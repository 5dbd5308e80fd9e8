"""The place and direction that a user indicates with a click or a drag."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose

_LEAST_SPREAD, _LEAST_HEADING_SPREAD = 0.1, 0.1
"""Metres and radians: minimum uncertainty of where a car is on a map, even if it is zoomed in. Chosen by
judgement."""


@dataclass(frozen=True, eq=False)
class Pointed:
    """A place, and optionally a direction, with the precision of a finger."""

    place: NDArray[np.float64]
    """(2,) metres in the map."""
    spread: float
    """Standard deviation of the place in metres, the same in every direction."""
    heading: float | None = None
    """Radians in the map; None if no direction was indicated."""
    heading_spread: float = math.pi
    """Standard deviation of the heading in radians."""

    def pose(self, otherwise: float) -> Pose:
        """(3,) pose; ``otherwise`` is the heading if none was indicated."""
        return np.array([*self.place, otherwise if self.heading is None else self.heading])


def pointed(start: NDArray[np.float64], end: NDArray[np.float64], finger: float) -> Pointed:
    """The result of a drag from one place (2,) to another, for a ``finger`` width in metres on the floor. A
    drag shorter than that is a click. The longer the drag, the more precise its direction."""
    spread = max(finger, _LEAST_SPREAD)
    ahead = end - start
    length = math.hypot(*ahead)
    if length <= finger:
        return Pointed(start, spread)
    both_ends = math.atan2(math.sqrt(2.0) * finger, length)
    return Pointed(start, spread, math.atan2(ahead[1], ahead[0]), max(both_ends, _LEAST_HEADING_SPREAD))
