"""The parts of a drive on which the car's place is not known, gathered on the way."""

import numpy as np

from racecar.localization.pose_estimate import PoseEstimate
from racecar.localization.verdict.drive_quality import UnknownSegment
from racecar.localization.verdict.known_place import is_lost, is_place_known

_SHORTEST = 0.5
"""Seconds of an unknown place that are reported, and between two that are one, since nobody looks for a
shorter one. By judgement."""
_MOST = 20
"""Segments that are reported, the longest, so that a report stays readable. By judgement."""


class UnknownSegments:
    """Joins scans of an unknown place; the shortest segments are forgotten when there are too many."""

    def __init__(self) -> None:
        self._closed: list[UnknownSegment] = []
        self._open: UnknownSegment | None = None

    def follow(self, estimate: PoseEstimate, begin: float, end: float) -> None:
        """Take in a scan that stands for the time between some seconds of the drive."""
        segment = self._open
        if is_place_known(estimate):
            if segment is not None and begin - segment.seconds[1] > _SHORTEST:
                self._close(segment)
                self._open = None
            return
        lost = is_lost(estimate)
        if segment is None:
            place = np.array(estimate.map_from_base[:2])
            self._open = UnknownSegment((begin, end), place, lost)
        else:
            seconds = segment.seconds[0], end
            self._open = UnknownSegment(seconds, segment.place, segment.is_lost or lost)

    @property
    def longest(self) -> tuple[UnknownSegment, ...]:
        """In the order of time."""
        segment = self._open  # once, as another thread may close it meanwhile
        last = [] if segment is None or not self._is_notable(segment) else [segment]
        return (*self._closed, *last)

    def _close(self, segment: UnknownSegment) -> None:
        if not self._is_notable(segment):
            return
        self._closed.append(segment)
        if len(self._closed) > _MOST:
            self._closed.remove(min(self._closed, key=_length))

    def _is_notable(self, segment: UnknownSegment) -> bool:
        return _length(segment) >= _SHORTEST


def _length(segment: UnknownSegment) -> float:
    return segment.seconds[1] - segment.seconds[0]
