"""Which scans of a drive are laid over the map: evenly along the path, however long the car stood."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose

_SPARE = 8
"""Times as many are kept as are wanted, so that some lie near where they are wanted once the end is known."""
_STANDING = 1e-5
"""Metres that a scan counts as without motion: of a car that never drives the scans are spread over the time,
and an hour of standing counts less than a few metres. By judgement."""


@dataclass(frozen=True, eq=False)
class Moment:
    """A scan as the localizer saw it."""

    stamp: int
    map_from_base: Pose
    points_in_map: NDArray[np.float64]
    """(N, 2) end points of the returns."""
    share_on_wall: float
    """Share of the end points that lie on a wall; nan when there are none."""


class MomentsAlong:
    """Takes in a drive of unknown length, scan by scan, in a memory that does not grow with it."""

    def __init__(self, count: int) -> None:
        """At the end there are at most ``count`` moments."""
        self._count = count
        self._kept: list[tuple[float, Moment]] = []
        self._scans = 0
        self._end, self._step = 0.0, 0.0

    def add(self, metres: float, moment: Moment) -> None:
        """Take in a scan that was taken after so much of the path."""
        self._end = metres + _STANDING * self._scans
        self._scans += 1
        if self._kept and self._end < self._kept[-1][0] + self._step:
            return
        self._kept.append((self._end, moment))
        if len(self._kept) > _SPARE * self._count:
            self._thin_out()

    @property
    def moments(self) -> list[Moment]:
        """In the order of time, each in the middle of an equal part of the path."""
        if not self._kept:
            return []
        begin = self._kept[0][0]
        length = self._end - begin
        wanted = (begin + (number + 0.5) / self._count * length for number in range(self._count))
        nearest = (
            min(range(len(self._kept)), key=lambda index: abs(self._kept[index][0] - place))
            for place in wanted
        )
        return [self._kept[index][1] for index in dict.fromkeys(nearest)]

    def _thin_out(self) -> None:
        self._step = 2.0 * (self._end - self._kept[0][0]) / len(self._kept)
        kept: list[tuple[float, Moment]] = []
        for each in self._kept:
            if not kept or each[0] >= kept[-1][0] + self._step:
                kept.append(each)
        self._kept = kept
