"""Mean and covariance of the dominant cluster of particles."""

import numpy as np
from numpy.typing import NDArray

from racecar.localization.filter.particle_kernels import in_heaviest_block, moments_about
from racecar.maps.geometry.se2 import Pose, mean_angle

_SQUARE = 0.5
"""Cell size in metres of the histogram that finds the densest place, half of `_RADIUS`, so that a block of
two by two is within the cluster around its centre."""
_SECTORS = 8
"""Heading bins: eighths of a turn, so that a block of two is a quarter of a turn, which separates headings
from those along a crossing corridor."""
_RADIUS, _HALF_ANGLE = 1.0, 1.0
"""Metres and radians around that place within which particles belong to the cluster. Chosen by judgement,
since no tracked cloud is wider."""
_WHOLE = 1.0 - 1e-9
"""Total weight of all particles: below 1 because of rounding."""


def cluster_moments(
    map_from_base: Pose, weights: NDArray[np.float64]
) -> tuple[Pose, NDArray[np.float64], float]:
    """Mean (3,), covariance (3, 3) and weight of the dominant cluster of particles (N, 3).

    The search is skipped if all particles are close to the first one.
    """
    mean, covariance, weight = moments_about(map_from_base[0], map_from_base, weights, _RADIUS, _HALF_ANGLE)
    if weight < _WHOLE:
        center = _heaviest_place(map_from_base, weights)
        mean, covariance, weight = moments_about(center, map_from_base, weights, _RADIUS, _HALF_ANGLE)
    return mean, covariance, min(weight, 1.0)


def _heaviest_place(map_from_base: Pose, weights: NDArray[np.float64]) -> Pose:
    """Mean (3,) of the particles in the heaviest block of two by two cells and two heading bins.

    Each particle is in eight blocks, so that bin boundaries do not matter.
    """
    squares = ((map_from_base[:, :2] - map_from_base[:, :2].min(axis=0)) // _SQUARE).astype(np.int64)
    sectors = (map_from_base[:, 2] // (2.0 * np.pi / _SECTORS)).astype(np.int64) % _SECTORS
    is_there = in_heaviest_block(squares, sectors, _SECTORS, weights)
    there, weights = map_from_base[is_there], weights[is_there]
    x, y = np.average(there[:, :2], axis=0, weights=weights)
    return np.array([x, y, mean_angle(there[:, 2], weights)])
