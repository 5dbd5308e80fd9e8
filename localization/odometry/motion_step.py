"""The car's motion between two moments, and how uncertain it is."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose


@dataclass(frozen=True, eq=False)
class MotionStep:
    """The motion between two moments."""

    base_from_next_base: Pose
    deviations: Pose
    """(3,) standard deviations in metres and radians."""
    travel: float
    """Metres plus radians that the car may have moved; inf where nothing measured it."""
    seconds: float
    """inf where the clock was set back, so that the time is unknown."""
    effort: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))
    """(2,) how hard the tyres were pushed along the car and across it, 0 to 1."""
    behind: Pose = field(default_factory=lambda: np.zeros(3))
    """(3,) to add to the motion of a car that is behind what its odometry says, see `slip`."""
    is_over_gap: bool = False
    """Whether so much time has passed that the car may have been carried to anywhere."""
