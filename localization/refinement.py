"""The estimate laid on the walls: what the filter's wide sensor model leaves undecided.

The beam model takes half a metre of disagreement for noise, so people and furniture that the map lacks
draw the cloud aside. From the filter's estimate, a robust alignment of the end points to the nearest walls
finds the pose that most of the scan agrees with. Along a corridor, where walls do not tell, the cloud does.
"""

import numpy as np
from numpy.typing import NDArray

from localization.beams import Beams
from localization.refinement_kernels import align_to_walls
from localization.walls import Walls
from maps.se2 import Pose, compose, inverse, transform_points

_FEWEST_POINTS = 10
_FARTHEST = 0.5
"""Metres or radians that an estimate may be moved."""


def refine(
    map_from_base: Pose, covariance: NDArray[np.float64], beams: Beams, walls: Walls
) -> tuple[Pose, NDArray[np.float64]]:
    """The pose (3,) near an estimate where most end points lie on walls, and its covariance (3, 3).

    The estimate and its covariance (3, 3) are that of the cloud; they are returned where walls tell nothing.
    """
    points_in_base = transform_points(beams.base_from_laser, beams.end_points)
    if len(points_in_base) < _FEWEST_POINTS:
        return map_from_base, covariance
    map_from_grid = walls.grid.map_from_grid
    start = compose(inverse(map_from_grid), map_from_base)
    turn = _turn(map_from_grid[2])
    aligned, uncertainty = align_to_walls(
        start, turn.T @ covariance @ turn, points_in_base, walls.distances, walls.grid.resolution
    )
    if np.any(np.abs(aligned - start) > _FARTHEST):
        return map_from_base, covariance
    return compose(map_from_grid, aligned), turn @ uncertainty @ turn.T


def _turn(angle: float) -> NDArray[np.float64]:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
