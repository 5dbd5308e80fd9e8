"""How many particles a cloud needs: the more places it covers, the more.

Dieter Fox: Adapting the Sample Size in Particle Filters Through KLD-Sampling, Int. J. of Robotics Research
22 (2003). With so many particles the Kullback-Leibler distance between them and the cloud that they stand
for stays below a bound, with high probability.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.localization.filter.adaptive_count_kernels import count_occupied
from racecar.maps.geometry.se2 import Pose

_BIN = np.array([0.1, 0.1, np.radians(5.0)])
"""Metres and radians within which particles stand for the same place."""
_DISTANCE = 0.02
_NORMAL_QUANTILE = 2.326
"""Of 99 %, the probability that the bound is kept."""
_LEAST_SHARE = 0.01
"""Of an even weight; particles lighter than this will not be drawn again and cover nothing."""


def needed_particles(map_from_base: Pose, weights: NDArray[np.float64], fewest: int, most: int) -> int:
    """The count for particles (N, 3) of weights (N,) that sum to 1, between ``fewest`` and ``most``."""
    if fewest >= most:
        return most
    occupied = count_occupied(map_from_base, weights, _BIN, _LEAST_SHARE / len(weights))
    if occupied <= 1:
        return fewest
    tail = 2.0 / (9.0 * (occupied - 1))
    bound = (occupied - 1) / (2.0 * _DISTANCE) * (1.0 - tail + np.sqrt(tail) * _NORMAL_QUANTILE) ** 3
    return int(np.clip(np.ceil(bound), fewest, most))
