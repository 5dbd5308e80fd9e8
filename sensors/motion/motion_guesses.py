"""How far the laser has moved since the last keyframe, as each source guesses it."""

from dataclasses import dataclass
from enum import Enum

import numpy as np

from racecar.maps.geometry.se2 import IDENTITY, Pose


class GuessSource(Enum):
    """Where a guess comes from, the most trusted first."""

    WHEELS_OR_FILTER = "wheels or filter"
    """Wheel odometry or, while there is none, the velocity filter; absent while neither is trusted."""
    SCAN_ODOMETRY = "scan odometry"
    STEADY_VELOCITY = "steady velocity"
    """Going on with the velocity of the last keyframe."""


@dataclass(frozen=True, eq=False)
class MotionGuesses:
    """Guesses of keyframe_from_laser (3,) by source, the most trusted first."""

    by: dict[GuessSource, Pose]

    @property
    def sources(self) -> tuple[GuessSource, ...]:
        """(H) of `motions`."""
        return tuple(self.by)

    @property
    def motions(self) -> Pose:
        """(H, 3) keyframe_from_laser."""
        return np.array(list(self.by.values()))

    @property
    def best(self) -> Pose:
        """(3,) the most trusted."""
        return next(iter(self.by.values()))

    def of(self, source: GuessSource) -> Pose:
        """(3,) by one source, the most trusted where it says nothing."""
        return self.by.get(source, self.best)

    @property
    def first(self) -> "MotionGuesses":
        """Only the most trusted."""
        return MotionGuesses({self.sources[0]: self.best})

    def without(self, source: GuessSource) -> "MotionGuesses":
        """Those of all sources but one."""
        return MotionGuesses({each: motion for each, motion in self.by.items() if each != source})

    def reach(self, distance: float, angle: float) -> bool:
        """Has the laser moved so many metres or radians, by any source that has seen the motion?"""
        steady = GuessSource.STEADY_VELOCITY
        x, y, turn = np.array([motion for source, motion in self.by.items() if source != steady]).T
        return bool(np.hypot(x, y).max() >= distance or np.abs(turn).max() >= angle)


AT_KEYFRAME = MotionGuesses({GuessSource.STEADY_VELOCITY: IDENTITY})
"""Of the scan that is the keyframe."""
