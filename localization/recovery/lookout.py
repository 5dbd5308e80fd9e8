"""Looking out for places that scans fit better than where the car is taken to be.

Again and again a part of the map is looked at, so that a round over all of it takes some seconds. On the
right map hardly any scan fits notably better elsewhere, even where much has changed; on a wrong one nearly
all do, each at another place, and so do those of a car that was carried off. Along a corridor without doors
they fit elsewhere as well, but not better.
"""

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from racecar.localization.recovery.perception import Perception
from racecar.localization.sensor.end_points import EndPoints
from racecar.maps.geometry.se2 import Pose

_PLACES_PER_SECOND = 4_000
"""That are looked at, so that a round takes a second on a floor of 640 m², and a hundredth of a core."""
_EVERY, _LONGEST = 0.05, 1.0
"""Seconds between looks, since those of faster lasers say no more than those of usual ones; and for which one
looks at most, so that none takes long after a pause."""
_APART = 1.0
"""Metres; what is nearer is the same place. By judgement: twice what an alignment may move."""
_ALIGNED = 2
"""Places of each part, those that fit best, at which the scan is laid on the walls. Measured: with 6,
and with more places, no verdict on right and wrong maps differs."""
_SPREAD = np.diag([0.04, 0.04, 0.01])
"""(3, 3) of such a place: by judgement, half the way to the next, in metres and radians, squared."""


@dataclass(frozen=True, eq=False)
class Look:
    """What a scan says of a part of the map."""

    seconds: float
    """Since the last look."""
    margin: float
    """By how much its log-likelihood is higher at the place that the part is compared with."""
    whole_margin: float | None
    """At the end of a round, the least of all parts."""


class Lookout:
    """Compares scans with all of the map, a part at a time."""

    def __init__(self) -> None:
        self.start_anew()

    def start_anew(self) -> None:
        """What was seen so far was compared with another place."""
        self._looked_at = self._seconds = 0.0
        self._least = inf

    def look(
        self, map_from_base: Pose, points: EndPoints, seconds: float, perception: Perception
    ) -> Look | None:
        """Compare a scan at a pose (3,), so many seconds after the last, with a part of the map, if it is
        time."""
        self._seconds += seconds
        if self._seconds < _EVERY:
            return None
        seconds, self._seconds = min(self._seconds, _LONGEST), 0.0
        first = int(self._looked_at)
        self._looked_at += _PLACES_PER_SECOND * seconds
        part = slice(first, int(self._looked_at))
        poses = np.vstack([map_from_base, self._elsewhere(map_from_base, points, part, perception)])
        fits = perception.log_likelihood(poses, points)
        margin = float(fits[0] - fits[1:].max(initial=-inf))
        self._least = min(self._least, margin)
        whole_margin = None
        if self._looked_at >= perception.places.coarse_count:
            whole_margin = self._least
            self.start_anew()
        return Look(seconds, margin, whole_margin)

    @staticmethod
    def _elsewhere(map_from_base: Pose, points: EndPoints, part: slice, perception: Perception) -> Pose:
        """(M, 3) where the scan, laid on the walls, fits best in a part of the map that is not here."""
        point = map_from_base[:2]
        found = perception.places.best_elsewhere(part, points, point, _APART, _ALIGNED)
        aligned: Pose = np.empty_like(found)
        for number, pose in enumerate(found):
            aligned[number] = perception.aligned(pose, _SPREAD, points)
        is_apart: NDArray[np.bool_] = np.hypot(*(aligned[:, :2] - point).T) > _APART
        return aligned[is_apart]
