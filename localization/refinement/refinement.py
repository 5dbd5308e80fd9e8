"""The estimate laid on the walls: what the filter's wide sensor model leaves undecided.

The beam model takes half a metre of disagreement for noise, so people and furniture that the map lacks
draw the cloud aside. From the filter's estimate, a robust alignment of the end points to the nearest walls
finds the pose that most of the scan agrees with. Along a corridor, where walls do not tell, the cloud does.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.localization.floor.walls import Walls
from racecar.localization.refinement.refinement_kernels import align_to_walls, points_of
from racecar.localization.sensor.beams import Beams
from racecar.maps.geometry.se2 import Pose

_FEWEST_POINTS = 10
_FARTHEST = 0.5
"""Metres or radians that an estimate may be moved."""


def refine(
    map_from_base: Pose, covariance: NDArray[np.float64], beams: Beams, walls: Walls
) -> tuple[Pose, NDArray[np.float64]]:
    """The pose (3,) near an estimate where most end points lie on walls, and its covariance (3, 3).

    The estimate and its covariance (3, 3) are that of the cloud; they are returned where walls tell nothing.
    """
    points_in_base = points_of(beams.bearings, beams.ranges, beams.base_from_laser)
    if len(points_in_base) < _FEWEST_POINTS:
        return map_from_base, covariance
    aligned, uncertainty = align_to_walls(
        map_from_base,
        covariance,
        walls.grid_from_map,
        points_in_base,
        walls.distances,
        walls.grid.resolution,
    )
    moved = np.abs(aligned - map_from_base)
    if moved[0] > _FARTHEST or moved[1] > _FARTHEST or _FARTHEST < moved[2] < 2.0 * np.pi - _FARTHEST:
        return map_from_base, covariance
    return aligned, uncertainty
