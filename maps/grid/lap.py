"""Find a closed lap in a car's path: back to the same place in the same direction."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from shapely import LineString, Polygon, node, polygonize

from racecar.maps.geometry.se2 import Pose, wrap_angle

_STEP = 0.1
"""Metres between the points of the path that are compared, since a lap need not close to the centimetre."""
_SHORTEST = 5.0
"""Minimum length of a lap in metres. Chosen by judgement: a small car's tightest circle is 4 m."""
CLOSING_DISTANCE = 2.0
"""Maximum gap in metres between start and end of a lap, closed by a straight line. Chosen by judgement: less
than the distance between two lanes."""
_CLOSING_TURN = 0.8
"""Maximum difference of headings in radians. Chosen by judgement: crossing paths meet at a right angle."""


def find_lap(map_from_base: Pose) -> NDArray[np.float64] | None:
    """(N, 2) metres in the map: the first lap among poses (K, 3) that closes well, in driving direction and
    without repeating its first point; None where there is none."""
    path, headings = _evenly(map_from_base[:, :2])
    if len(path) < 2:
        return None
    pairs = cKDTree(path).query_pairs(CLOSING_DISTANCE, output_type="ndarray")
    first, last = pairs.min(axis=1), pairs.max(axis=1)
    is_lap = (last - first) * _STEP >= _SHORTEST
    is_lap &= np.abs(wrap_angle(headings[last] - headings[first])) <= _CLOSING_TURN
    first, last = first[is_lap], last[is_lap]
    if len(first) == 0:
        return None
    soonest = last <= last.min() + int(CLOSING_DISTANCE / _STEP)
    gaps = np.hypot(*(path[last] - path[first]).T)
    best = np.flatnonzero(soonest)[np.argmin(gaps[soonest])]
    return path[first[best] : last[best]]


def _evenly(places: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Resample a path to points (N, 2) `_STEP` metres apart, with headings (N,) in radians."""
    steps = np.hypot(*np.diff(places, axis=0).T)
    moves = np.append(True, steps > 0.0)
    places, along = places[moves], np.append(0.0, np.cumsum(steps[steps > 0.0]))
    at = np.arange(0.0, along[-1], _STEP)
    path = np.column_stack([np.interp(at, along, axis) for axis in places.T])
    ahead = np.gradient(path, axis=0) if len(path) > 1 else np.zeros_like(path)
    return path, np.arctan2(ahead[:, 1], ahead[:, 0])


def inside_of(lap: NDArray[np.float64]) -> Polygon:
    """The area that a lap encloses. If the lap crosses itself, as after a spin, the largest part."""
    loops = polygonize([node(LineString([*lap, lap[0]]))])
    return max(loops.geoms, key=lambda loop: loop.area, default=Polygon())
