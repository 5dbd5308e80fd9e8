"""The turn between two scans, where no wheels report it.

A car may suddenly turn by ten degrees between two scans. Registration that starts without that turn gets
stuck in a wrong minimum. So correlative scan matching finds the turn first.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.sensors.matching.correlative_search import LikelihoodPyramid, Window, search

_MAX_TURN = 0.5
"""Search range in radians to each side. Chosen by judgement: a car sometimes turns by ten degrees between two
scans, as fr079 showed."""
_PREDICTED_TURN = 0.02
"""Radians within which a turn counts as the predicted one. Chosen by judgement: 1.5 steps of the search."""
_REACH = 0.2
"""Search range in metres to each side, since the prediction may be off by this much."""
_MIN_GAIN = 1.1
"""Factor by which another turn must score better than the predicted one. Chosen by judgement: noise gains a
few per cent."""
_MIN_SCORE = 0.3
"""Minimum mean likelihood of an accepted turn. Chosen by judgement: a third of the points on walls."""
_RADIUS = 15.0
"""Maximum range of points, metres. Chosen by judgement: far walls show a turn too, but slow the search."""
_MIN_POINTS = 30
"""Minimum points of a scan to determine a turn, since a few fit anywhere."""
_MAX_POINTS = 200
"""Maximum points used in the search. Chosen by judgement: more take longer and find no other turn."""


def with_turn_seen(last: NDArray[np.float64], points: NDArray[np.float64], motion: Pose) -> Pose:
    """The predicted ``motion`` (3,), with another turn if the scan then fits the last one clearly better.

    The distance stays as predicted: along a bare corridor the scans fit anywhere.

    ``points`` (N, 2) and those of the ``last`` scan (M, 2) are in metres, each in its own laser frame; the
    motion is last_from_now.
    """
    fixed, moving = _near(last), _near(points)
    if min(len(fixed), len(moving)) < _MIN_POINTS:
        return motion
    pyramid = LikelihoodPyramid(fixed, _RADIUS)
    moving = moving[:: 1 + len(moving) // _MAX_POINTS]
    as_predicted, turned = Window(_REACH, _PREDICTED_TURN), Window(_REACH, _MAX_TURN)
    predicted = search(pyramid, moving, motion, as_predicted, _MIN_SCORE / _MIN_GAIN)
    min_score = _MIN_SCORE if predicted is None else _MIN_GAIN * predicted.score
    found = search(pyramid, moving, motion, turned, min_score)
    return motion if found is None else np.array([motion[0], motion[1], found.pose[2]])


def _near(points: NDArray[np.float64]) -> NDArray[np.float64]:
    near: NDArray[np.float64] = points[(np.abs(points) < _RADIUS).all(axis=1)]
    return near
