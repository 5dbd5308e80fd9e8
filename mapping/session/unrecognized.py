"""Explain to people why a drive was not recognized on an earlier map, and how far recognition got."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from racecar.mapping.session.drive_placement import Placement
from racecar.mapping.session.place_comparison import PlaceComparison
from racecar.mapping.session.session import Session
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import compose


class NotRecognizedError(UserError):
    """A drive was not recognized on an earlier map.

    Its sentence has no full stop, so that callers can append advice.
    """


@dataclass(frozen=True, eq=False)
class Unrecognized:
    """A drive that is not recognized."""

    session: Session
    """Both, the earlier map first."""
    first: int
    """First keyframe of the drive."""
    metres: float
    """Length of the drive."""
    is_given: bool
    """Whether the user stated where the drive begins."""

    def as_too_short(self) -> NotRecognizedError:
        """The error for a drive that is too short to tell."""
        return self._error(f"its {self.metres:.0f} m are too few to be sure")

    def as_found(self, comparison: PlaceComparison | None) -> NotRecognizedError:
        """The error for a drive that is nowhere certain, given the places found for it, if any."""
        return self._error(self._why(comparison))

    def _why(self, comparison: PlaceComparison | None) -> str:
        stated, length = "its scans do not fit where it was said to begin", f"its {self.metres:.0f} m"
        if comparison is None:
            return stated if self.is_given else f"on all of {length} no place there fits its scans"
        best, rival = comparison.best, comparison.rival
        begins = f"it fits best if it begins at {self._start(best)}"
        there = f"{stated}: " if self.is_given else f"{begins}, where "
        if not comparison.is_seen_enough:
            seen = best.explained * self.metres
            return f"{there}only {seen:.0f} of {length} lie on the map, too few to be sure"
        contradict = f"{there}{best.contradicted:.1%} of what it and the map see of each other contradict"
        if rival is None or not best.agrees:
            return f"{contradict}, {best.usual:.1%} would be usual"
        other = f"{rival.contradicted:.1%} if it begins at {self._start(rival)}"
        if self.is_given:
            return f"{contradict}, and only {other}"
        return f"{contradict}, and {other}: too alike to tell these places apart"

    def _start(self, placement: Placement) -> str:
        """Where the car starts, as one may state it."""
        pose = compose(placement.poses[0], self.session.keyframe_from_base[self.first])
        x, y, yaw = np.round(pose, 1) + 0.0  # avoids -0.0
        return f"x {x:.1f} m, y {y:.1f} m, yaw {yaw:.1f}"

    def _error(self, why: str) -> NotRecognizedError:
        times = self.session.times
        earlier, later = (
            _listed(times.recordings[k].name for k in np.unique(times.numbers[part]))
            for part in (slice(self.first), slice(self.first, None))
        )
        drive = f"The drive {later}".rstrip()
        of = f" of {earlier}" if earlier else ""
        return NotRecognizedError(f"{drive} was not recognized on the earlier map{of}: {why}")


def _listed(names: Iterable[str]) -> str:
    return ", ".join(name for name in names if name)
