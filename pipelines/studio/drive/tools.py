"""What clicks and drags on the floor mean while one drives."""

import math
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose

_SHORTEST = 0.1
"""Metres; a shorter drag shows no direction."""


class Tool(str, Enum):
    """As the panel names it."""

    DRIVE = "Drive there"
    ESTIMATE = "Say where the car is"
    CARRY = "Carry the car"


HELP = {
    Tool.DRIVE: "Click a place, and the car drives there.",
    Tool.ESTIMATE: "Drag from where the car is to where it looks: the localizer starts there. "
    "A click leaves the heading open.",
    Tool.CARRY: "Drag from where the car shall stand to where it shall look. The localizer is not told.",
}


def dragged_pose(start: NDArray[np.float64], end: NDArray[np.float64]) -> Pose | None:
    """(3,) at the start of a drag, looking to its end; None where it is too short to show a direction."""
    ahead = end - start
    if math.hypot(*ahead) < _SHORTEST:
        return None
    return np.array([*start, math.atan2(ahead[1], ahead[0])])
