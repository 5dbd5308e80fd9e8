"""How far a scan is turned from the last one, where no wheels tell.

A car may turn by ten degrees between two scans, all of a sudden. Registration that begins without that turn
sticks, and goes on without it; so the turn is sought by correlative scan matching first.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.matching.correlative_search import LikelihoodPyramid, Window, search
from racecar.maps.geometry.se2 import Pose

_AS_PREDICTED, _TURNED = Window(0.2, 0.02), Window(0.2, 0.5)
_CLEARLY_BETTER = 1.1
_LEAST_SCORE = 0.3
_RADIUS = 15.0
"""Metres; far walls tell a turn too, but make the search slow."""
_FEWEST_POINTS, _MOST_POINTS = 30, 200


def turned_as_seen(last: NDArray[np.float64], points: NDArray[np.float64], motion: Pose) -> Pose:
    """A predicted ``motion`` (3,), turned otherwise where a scan then lies clearly better on the last one.

    How far the car went meanwhile stays as predicted: along a bare corridor the scans fit anywhere.

    ``points`` (N, 2) and those of the ``last`` scan (M, 2) are in metres, each in its own laser's frame; the
    motion is last_from_now.
    """
    fixed, moving = _near(last), _near(points)
    if min(len(fixed), len(moving)) < _FEWEST_POINTS:
        return motion
    pyramid, moving = LikelihoodPyramid(fixed, _RADIUS), moving[:: 1 + len(moving) // _MOST_POINTS]
    predicted = search(pyramid, moving, motion, _AS_PREDICTED, _LEAST_SCORE / _CLEARLY_BETTER)
    least = _LEAST_SCORE if predicted is None else _CLEARLY_BETTER * predicted.score
    found = search(pyramid, moving, motion, _TURNED, least)
    return motion if found is None else np.array([motion[0], motion[1], found.pose[2]])


def _near(points: NDArray[np.float64]) -> NDArray[np.float64]:
    near: NDArray[np.float64] = points[(np.abs(points) < _RADIUS).all(axis=1)]
    return near
