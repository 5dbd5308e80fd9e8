"""Explain to people why a drive was not recognized on an earlier map, and how far recognition got."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from racecar.mapping.loops.hypothesis import Hypothesis
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose, compose


class NotRecognizedError(UserError):
    """A drive was not recognized on an earlier map.

    Its sentence has no full stop, so that callers can append advice.
    """


@dataclass(eq=False)
class Recognition:
    """Progress of recognizing a drive."""

    poses: Pose
    """(K, 3) keyframe poses, those of the earlier map first; both in unrelated frames."""
    first: int
    """First keyframe of the drive."""
    is_given: bool
    """Whether the user stated where the drive begins."""
    is_too_short: bool
    """Whether the drive has too few submaps."""
    found: list[Hypothesis] = field(default_factory=list)
    """Verified hypotheses for submaps of the drive."""
    rivals: list[Hypothesis] = field(default_factory=list)
    """Hypotheses elsewhere on the map that contradict them."""
    last_known: int | None = None
    """Last keyframe with a candidate pose."""
    last_place: Pose | None = None
    """(3,) its candidate pose on the earlier map."""

    def failure(self, path: Sequence[float]) -> NotRecognizedError:
        """The error with its explanation, given metres driven up to each keyframe (K)."""
        return NotRecognizedError(f"The drive was not recognized on the earlier map: {self._how_far(path)}")

    def _how_far(self, path: Sequence[float]) -> str:
        metres = path[-1] - path[self.first]
        if self.is_too_short:
            return f"its {metres:.0f} m are too few to be sure"
        if self.last_known is None or self.last_place is None:
            if self.is_given:
                return "its scans do not fit where it was said to begin"
            return f"on all of its {metres:.0f} m no place there fits its scans, or several do"
        if self.rivals:
            found, rival = self.found[-1], self.rivals[-1]
            first, second = (compose(self.poses[h.fixed.middle], h.fixed_from_moving) for h in (found, rival))
            return f"it fits at {_in_words(first)} as well as at {_in_words(second)}"
        known = path[self.last_known] - path[self.first]
        at = f"{known:.0f} m into it the car seemed to be at {_in_words(self.last_place)}"
        if self.found:
            return f"{at}, but too few of its {metres:.0f} m fit the walls there"
        return f"{at}, but its scans contradict the walls there"


def _in_words(pose: Pose) -> str:
    x, y, yaw = np.round(pose, 1) + 0.0  # avoids -0.0
    return f"x {x:.1f} m, y {y:.1f} m, yaw {yaw:.1f}"
