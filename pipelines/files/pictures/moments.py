"""Selection of scans to draw over the map: evenly spaced along the path, however long the car stood."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose

_SPARE = 8
"""Ratio of scans kept to scans wanted, so some are near the wanted places once the end is known."""
_STANDING = 1e-5
"""Metres that a scan counts for without motion. In a recording without motion, scans are then spread over
time, while an hour of standing counts less than a few metres. Chosen by judgement."""


@dataclass(frozen=True, eq=False)
class Moment:
    """A scan as the localizer saw it."""

    stamp: int
    map_from_base: Pose
    points_in_map: NDArray[np.float64]
    """(N, 2) end points of the returns."""
    share_on_wall: float
    """Share of the end points that lie on a wall; nan if there are none."""


class MomentsAlong:
    """Selects scans from a drive of unknown length, one at a time, with bounded memory."""

    def __init__(self, count: int) -> None:
        """At most ``count`` moments are selected at the end."""
        self._count = count
        self._kept: list[tuple[float, Moment]] = []
        self._scans = 0
        self._end, self._step = 0.0, 0.0

    def add(self, metres: float, moment: Moment) -> None:
        """Add a scan taken after ``metres`` of the path."""
        self._end = metres + _STANDING * self._scans
        self._scans += 1
        if self._kept and self._end < self._kept[-1][0] + self._step:
            return
        self._kept.append((self._end, moment))
        if len(self._kept) > _SPARE * self._count:
            self._thin_out()

    @property
    def moments(self) -> list[Moment]:
        """In time order, each at the centre of an equal part of the path."""
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
