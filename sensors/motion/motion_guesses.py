"""Guesses, by several sources, of the laser's motion since the last keyframe."""

from dataclasses import dataclass
from enum import Enum

import numpy as np

from racecar.maps.geometry.se2 import IDENTITY, Pose


class GuessSource(Enum):
    """The source of a guess, the most trusted first."""

    WHEELS_OR_FILTER = "wheels or filter"
    """Wheel odometry or, without it, the velocity filter; absent while neither is trusted."""
    SCAN_ODOMETRY = "scan odometry"
    STEADY_VELOCITY = "steady velocity"
    """The velocity of the last keyframe, held constant."""


@dataclass(frozen=True, eq=False)
class MotionGuesses:
    """Guesses of keyframe_from_laser (3,) by source, the most trusted first."""

    by: dict[GuessSource, Pose]

    @property
    def sources(self) -> tuple[GuessSource, ...]:
        """(H,) sources of `motions`."""
        return tuple(self.by)

    @property
    def motions(self) -> Pose:
        """(H, 3) keyframe_from_laser."""
        return np.array(list(self.by.values()))

    @property
    def best(self) -> Pose:
        """(3,) the most trusted guess."""
        return next(iter(self.by.values()))

    def of(self, source: GuessSource) -> Pose:
        """(3,) the guess of one source, or the most trusted guess if it has none."""
        return self.by.get(source, self.best)

    @property
    def first(self) -> "MotionGuesses":
        """Only the most trusted guess."""
        return MotionGuesses({self.sources[0]: self.best})

    def without(self, source: GuessSource) -> "MotionGuesses":
        """The guesses of all sources but one."""
        return MotionGuesses({each: motion for each, motion in self.by.items() if each != source})

    def reach(self, distance: float, angle: float) -> bool:
        """Whether the laser has moved this many metres or radians by any source that measured the motion."""
        steady = GuessSource.STEADY_VELOCITY
        x, y, turn = np.array([motion for source, motion in self.by.items() if source != steady]).T
        return bool(np.hypot(x, y).max() >= distance or np.abs(turn).max() >= angle)


AT_KEYFRAME = MotionGuesses({GuessSource.STEADY_VELOCITY: IDENTITY})
"""The guesses for the scan that is the keyframe."""
