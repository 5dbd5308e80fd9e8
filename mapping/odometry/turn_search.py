"""The turn between two scans, where no wheels report it.

A car may suddenly turn by ten degrees between two scans. Registration that starts without that turn sticks in
a wrong minimum and goes on without it; so correlative scan matching looks for the turn first.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.matching.correlative_search import LikelihoodPyramid, Window, search
from racecar.mapping.odometry.config import TurnSearchConfig
from racecar.maps.geometry.se2 import Pose


def with_turn_seen(
    last: NDArray[np.float64],
    points: NDArray[np.float64],
    motion: Pose,
    config: TurnSearchConfig,
) -> Pose:
    """A predicted ``motion`` (3,), with another turn where a scan then fits the last one clearly better.

    The distance stays as predicted: along a bare corridor the scans fit anywhere.

    ``points`` (N, 2) and those of the ``last`` scan (M, 2) are in metres, each in its own laser frame; the
    motion is last_from_now.
    """
    fixed, moving = _near(last, config.radius), _near(points, config.radius)
    if min(len(fixed), len(moving)) < config.min_points:
        return motion
    pyramid = LikelihoodPyramid(fixed, config.radius)
    moving = moving[:: 1 + len(moving) // config.max_points]
    as_predicted, turned = Window(config.reach, config.predicted_turn), Window(config.reach, config.max_turn)
    predicted = search(pyramid, moving, motion, as_predicted, config.min_score / config.min_gain)
    min_score = config.min_score if predicted is None else config.min_gain * predicted.score
    found = search(pyramid, moving, motion, turned, min_score)
    return motion if found is None else np.array([motion[0], motion[1], found.pose[2]])


def _near(points: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
    near: NDArray[np.float64] = points[(np.abs(points) < radius).all(axis=1)]
    return near
