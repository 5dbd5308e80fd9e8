"""The estimate aligned with the walls, which resolves what the filter's wide sensor model leaves open.

The beam model takes half a metre of disagreement for noise, so that people and furniture which the map lacks
draw the cloud aside. From the filter's estimate, a robust alignment of the end points with the nearest walls
finds the pose that most of the scan agrees with. Along a corridor, where walls do not constrain it, the cloud
does.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.localization.floor.walls import Walls
from racecar.localization.refinement.config import AlignmentConfig
from racecar.localization.refinement.refinement_kernels import align_to_walls
from racecar.localization.sensor.beams import Beams
from racecar.maps.geometry.se2 import Pose


BELIEF = 1.4


def refine(
    map_from_base: Pose, covariance: NDArray[np.float64], beams: Beams, walls: Walls, config: AlignmentConfig
) -> tuple[Pose, NDArray[np.float64]]:
    """The pose (3,) near an estimate where most end points lie on walls, and its covariance (3, 3).

    The estimate and its covariance (3, 3) are the cloud's; they are returned where the scan has too few
    points, or the alignment leads away.
    """
    points_in_base = beams.points_in_base
    if len(points_in_base) < config.fewest_points:
        return map_from_base, covariance
    aligned, uncertainty = align_to_walls(
        map_from_base,
        covariance,
        walls.grid_from_map,
        points_in_base,
        walls.distances,
        walls.grid.resolution,
        np.array(config.scales),
        config.wall_noise,
        config.points_per_observation,
        config.cloud_width,
        config.least_cloud,
        BELIEF,
    )
    moved, most = np.abs(aligned - map_from_base), config.largest_move
    if moved[0] > most or moved[1] > most or most < moved[2] < 2.0 * np.pi - most:
        return map_from_base, covariance
    return aligned, uncertainty
