"""Compare scans with the rest of the map, to detect places that fit better than the current one.

A part of the map is checked at a time, the whole map within some seconds. On the right map hardly any scan
fits notably better elsewhere, even where much has changed. On a wrong map nearly all do, each at another
place; so do those of a kidnapped car. In a corridor without doors they fit elsewhere as well, but not better.
"""

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from racecar.localization.recovery.perception import Perception
from racecar.localization.sensor.end_points import EndPoints
from racecar.maps.geometry.se2 import Pose

_PLACES_PER_SECOND = 4_000
"""Places checked per second, so that a round takes a second on 640 m², and a hundredth of a core."""
_EVERY, _LONGEST = 0.05, 1.0
"""Seconds between checks, since scans of faster lasers add no information; and the most time that one covers,
so that none takes long after a pause."""
_APART = 1.0
"""Metres within which places are the same. Chosen by judgement: twice the largest move of an alignment."""
_ALIGNED = 2
"""Best places of each part at which the scan is aligned with walls. Measured: with 6, and with more places,
no verdict on right and wrong maps differs."""
_SPREAD = np.diag([0.04, 0.04, 0.01])
"""(3, 3) covariance of such a place. Chosen by judgement: half the spacing, squared, in m² and rad²."""


@dataclass(frozen=True, eq=False)
class Look:
    """Comparison of a scan with a part of the map."""

    seconds: float
    """Seconds since the last comparison."""
    margin: float
    """Log-likelihood at the current place minus the best in this part."""
    whole_margin: float | None
    """Smallest margin of all parts, at the end of a round."""


class Lookout:
    """Compares scans with the whole map, a part at a time."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Discard comparisons with another current place."""
        self._looked_at = self._seconds = 0.0
        self._least = inf

    def look(
        self, map_from_base: Pose, points: EndPoints, seconds: float, perception: Perception
    ) -> Look | None:
        """If due, compare a scan at a pose (3,), ``seconds`` after the last, with the next part of the
        map."""
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
            self.reset()
        return Look(seconds, margin, whole_margin)

    @staticmethod
    def _elsewhere(map_from_base: Pose, points: EndPoints, part: slice, perception: Perception) -> Pose:
        """(M, 3) best poses in a part of the map away from the current place, aligned with the walls."""
        point = map_from_base[:2]
        found = perception.places.best_elsewhere(part, points, point, _APART, _ALIGNED)
        aligned: Pose = np.empty_like(found)
        for number, pose in enumerate(found):
            aligned[number] = perception.aligned(pose, _SPREAD, points)
        is_apart: NDArray[np.bool_] = np.hypot(*(aligned[:, :2] - point).T) > _APART
        return aligned[is_apart]
