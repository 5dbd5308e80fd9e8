"""Collect the parts of a drive on which the car's place is unknown."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from racecar.localization.pose_estimate import PoseEstimate

_SHORTEST = 0.5
"""Shortest reported segment in seconds, and shortest gap between two, since nobody looks for a shorter one.
Chosen by judgement."""
_MOST = 20
"""Number of longest segments that are reported, so that a report stays readable. Chosen by judgement."""


@dataclass(frozen=True, eq=False)
class UnknownSegment:
    """A part of the drive on which the car's place was unknown."""

    seconds: tuple[float, float]
    """Start and end in seconds since the drive began."""
    place: NDArray[np.float64]
    """(2,) metres in the map: the estimated position at its beginning."""
    is_lost: bool
    """Whether the car was probably elsewhere; else several places were possible, or a large one."""

    @property
    def length(self) -> float:
        """Duration in seconds."""
        return self.seconds[1] - self.seconds[0]

    @property
    def words(self) -> str:
        """Description for people."""
        begin, end = self.seconds
        when = f"at {begin:.0f} s" if self.length < 1.0 else f"at {begin:.0f} to {end:.0f} s"
        return f"{when} near x {self.place[0]:.1f} m, y {self.place[1]:.1f} m"

    def as_dict(self) -> dict[str, object]:
        """The entry in reports."""
        return {
            "from_s": self.seconds[0],
            "to_s": self.seconds[1],
            "x_m": float(self.place[0]),
            "y_m": float(self.place[1]),
            "lost": self.is_lost,
        }


class UnknownSegments:
    """Merges scans of an unknown place to segments; the shortest are dropped when there are too many."""

    def __init__(self) -> None:
        self._segments: tuple[UnknownSegment, ...] = ()
        """Replaced atomically, so that any thread may read it."""

    def follow(self, estimate: PoseEstimate, begin: float, end: float) -> None:
        """Add a scan that covers the time from ``begin`` to ``end`` in seconds of the drive."""
        if estimate.is_place_known:
            return
        last = self._segments[-1] if self._segments else None
        if last is not None and begin - last.seconds[1] <= _SHORTEST:
            is_lost = last.is_lost or estimate.is_lost
            longer = replace(last, seconds=(last.seconds[0], end), is_lost=is_lost)
            self._segments = (*self._segments[:-1], longer)
        else:
            place = np.array(estimate.map_from_base[:2])
            self._segments = (*self.longest, UnknownSegment((begin, end), place, estimate.is_lost))

    @property
    def longest(self) -> tuple[UnknownSegment, ...]:
        """The longest segments in time order."""
        notable = [segment for segment in self._segments if segment.length >= _SHORTEST]
        return longest_of(notable, _MOST)


def longest_of(segments: Sequence[UnknownSegment], count: int) -> tuple[UnknownSegment, ...]:
    """At most ``count`` of the longest segments, in time order."""
    longest = sorted(segments, key=lambda segment: segment.length)[-count:]
    return tuple(sorted(longest, key=lambda segment: segment.seconds))
