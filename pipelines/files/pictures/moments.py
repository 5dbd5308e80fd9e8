"""Selection of scans to draw over the map: the one that fits worst, and others evenly spaced along the path
up to its end, however long the car stood."""

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
        self._last: Moment | None = None
        self._worst: Moment | None = None
        self._was_known = False

    def add(self, metres: float, moment: Moment, *, is_known: bool) -> None:
        """Add a scan taken after ``metres`` of the path. Which one fits worst is asked from the first scan on
        whose place ``is_known``."""
        self._end = metres + _STANDING * self._scans
        self._scans += 1
        self._last = moment
        if is_known and not self._was_known:
            self._worst, self._was_known = None, True
        if not np.isnan(moment.share_on_wall) and (
            self._worst is None or moment.share_on_wall < self._worst.share_on_wall
        ):
            self._worst = moment
        if self._kept and self._end < self._kept[-1][0] + self._step:
            return
        self._kept.append((self._end, moment))
        if len(self._kept) > _SPARE * self._count:
            self._thin_out()

    @property
    def moments(self) -> list[Moment]:
        """The scan that fits worst; then, in time order, the scans at the ends of equal parts of the path."""
        if self._last is None:
            return []
        worst = [] if self._worst is None else [self._worst]
        parts = self._count - len(worst)
        along = [*self._kept, (self._end, self._last)]
        begin = along[0][0]
        wanted = (begin + number / parts * (self._end - begin) for number in range(1, parts))
        nearest = [min(along, key=lambda each: abs(each[0] - place))[1] for place in wanted]
        return list(dict.fromkeys([*worst, *nearest, self._last]))

    def _thin_out(self) -> None:
        self._step = 2.0 * (self._end - self._kept[0][0]) / len(self._kept)
        kept: list[tuple[float, Moment]] = []
        for each in self._kept:
            if not kept or each[0] >= kept[-1][0] + self._step:
                kept.append(each)
        self._kept = kept
