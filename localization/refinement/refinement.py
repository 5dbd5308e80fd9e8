"""The estimate aligned with the walls, closer than the cloud's particles lie beside one another.

A robust alignment of the end points with the nearest walls finds the pose that most of the scan agrees
with, whatever people and furniture the map lacks. Along a corridor, where walls do not constrain it, the
cloud does.
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
    """The pose (3,) near the mean of a cloud with a covariance (3, 3) where most end points lie on walls.

    The mean itself where the scan has too few points, or the alignment leads away. The surface of walls is so
    many metres before the centres of their cells.
    """
    return align_to_walls(map_from_base, covariance, points.in_base, walls.field(surface))


def refine(
    map_from_base: Pose, covariance: NDArray[np.float64], points: EndPoints, walls: Walls, surface: float
) -> tuple[Pose, NDArray[np.float64]]:
    """That pose and its covariance (3, 3); where there is no alignment, what was given."""
    pose = aligned(map_from_base, covariance, points, walls, surface)
    if np.array_equal(pose, map_from_base):
        return map_from_base, covariance
    return pose, covariance_given_walls(pose, covariance, points.in_base, walls.field(surface))
