"""The parts of a drive on which the car's place is not known, gathered on the way."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from racecar.localization.pose_estimate import PoseEstimate

_SHORTEST = 0.5
"""Seconds of an unknown place that are reported, and between two that are one, since nobody looks for a
shorter one. By judgement."""
_MOST = 20
"""Segments that are reported, the longest, so that a report stays readable. By judgement."""


@dataclass(frozen=True, eq=False)
class UnknownSegment:
    """A part of the drive on which the car's place was not known."""

    seconds: tuple[float, float]
    """Since the drive began."""
    place: NDArray[np.float64]
    """(2,) metres in the map, where the car was taken to be at its beginning."""
    is_lost: bool
    """Whether the car was rather elsewhere; else several places were possible, or a wide one."""

    @property
    def length(self) -> float:
        """Seconds."""
        return self.seconds[1] - self.seconds[0]

    @property
    def words(self) -> str:
        """For people."""
        begin, end = self.seconds
        when = f"at {begin:.0f} s" if self.length < 1.0 else f"at {begin:.0f} to {end:.0f} s"
        return f"{when} near x {self.place[0]:.1f} m, y {self.place[1]:.1f} m"

    def as_dict(self) -> dict[str, object]:
        """For reports."""
        return {
            "from_s": self.seconds[0],
            "to_s": self.seconds[1],
            "x_m": float(self.place[0]),
            "y_m": float(self.place[1]),
            "lost": self.is_lost,
        }


class UnknownSegments:
    """Joins scans of an unknown place; the shortest segments are forgotten when there are too many."""

    def __init__(self) -> None:
        self._segments: tuple[UnknownSegment, ...] = ()
        """Replaced as a whole, so that any thread may read them."""

    def follow(self, estimate: PoseEstimate, begin: float, end: float) -> None:
        """Take in a scan that stands for the time between some seconds of the drive."""
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
        """In the order of time."""
        notable = [segment for segment in self._segments if segment.length >= _SHORTEST]
        return longest_of(notable, _MOST)


def longest_of(segments: Sequence[UnknownSegment], count: int) -> tuple[UnknownSegment, ...]:
    """At most so many, in the order of time."""
    longest = sorted(segments, key=lambda segment: segment.length)[-count:]
    return tuple(sorted(longest, key=lambda segment: segment.seconds))
