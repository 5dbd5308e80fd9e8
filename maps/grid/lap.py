"""Find a closed lap in a car's path: back to the same place in the same direction."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from racecar.maps.geometry.polyline import resample
from racecar.maps.geometry.se2 import Pose, wrap_angle

_STEP = 0.1
"""Metres between the points of the path that are compared, since a lap need not close to the centimetre."""
SHORTEST_LAP = 5.0
"""Minimum length of a lap in metres. Chosen by judgement: a small car's tightest circle is 4 m."""
CLOSING_DISTANCE = 2.0
"""Maximum gap in metres between start and end of a lap, closed by a straight line. Chosen by judgement: less
than the distance between two lanes."""
_CLOSING_TURN = 0.5
"""Maximum difference of headings in radians. Chosen by judgement: lanes cross at a greater angle."""
_FOLLOWED, _ASIDE = 6.0, 3.0
"""Metres before and after a lap closes, as far as they were driven, and metres by which both ends are at most
apart there. Chosen by judgement: lanes that cross at more than 30° are farther apart."""


def find_lap(map_from_base: Pose) -> NDArray[np.float64] | None:
    """(N, 2) metres in the map: the first lap among poses (K, 3) that closes well, in driving direction and
    without repeating its first point; None where there is none."""
    path = resample(map_from_base[:, :2], _STEP)
    ahead = np.gradient(path, axis=0)
    headings = np.arctan2(ahead[:, 1], ahead[:, 0])
    pairs = cKDTree(path).query_pairs(CLOSING_DISTANCE, output_type="ndarray")
    first, last = pairs.min(axis=1), pairs.max(axis=1)
    is_lap = (last - first) * _STEP >= SHORTEST_LAP
    is_lap &= np.abs(wrap_angle(headings[last] - headings[first])) <= _CLOSING_TURN
    followed = int(_FOLLOWED / _STEP)
    for steps in (-np.minimum(followed, first), np.minimum(followed, len(path) - 1 - last)):
        is_lap &= _gaps(path, first + steps, last + steps) <= _ASIDE
    first, last = first[is_lap], last[is_lap]
    if len(first) == 0:
        return None
    soonest = last <= last.min() + int(CLOSING_DISTANCE / _STEP)
    best = np.flatnonzero(soonest)[np.argmin(_gaps(path, first, last)[soonest])]
    return path[first[best] : last[best]]


def _gaps(
    path: NDArray[np.float64], first: NDArray[np.int64], last: NDArray[np.int64]
) -> NDArray[np.float64]:
    """(N,) metres between pairs of points of a path."""
    gaps: NDArray[np.float64] = np.hypot(*(path[last] - path[first]).T)
    return gaps
