"""Align the estimate with walls, more accurately than the spacing of particles.

Robust alignment of the end points with the nearest walls finds the pose that most of the scan agrees with,
despite people and furniture missing in the map. Directions that walls do not constrain, as along a corridor,
follow the cloud.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.localization.floor.walls import Walls
from racecar.localization.refinement.refinement_kernels import align_to_walls, covariance_given_walls
from racecar.localization.sensor.end_points import EndPoints
from racecar.maps.geometry.se2 import Pose


def aligned(
    map_from_base: Pose, covariance: NDArray[np.float64], points: EndPoints, walls: Walls, surface: float
) -> Pose:
    """The pose (3,) near the mean of a cloud with covariance (3, 3) at which most end points lie on walls.

    The mean itself where the scan has too few points or the alignment diverges. The surface of walls is
    ``surface`` metres before the centres of their cells.
    """
    return align_to_walls(map_from_base, covariance, points.in_base, walls.field(surface))


def refine(
    map_from_base: Pose, covariance: NDArray[np.float64], points: EndPoints, walls: Walls, surface: float
) -> tuple[Pose, NDArray[np.float64]]:
    """The aligned pose and its covariance (3, 3); unchanged where alignment fails."""
    pose = aligned(map_from_base, covariance, points, walls, surface)
    if np.array_equal(pose, map_from_base):
        return map_from_base, covariance
    return pose, covariance_given_walls(pose, covariance, points.in_base, walls.field(surface))
