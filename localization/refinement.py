"""The estimate laid on the walls: what the filter's wide sensor model leaves undecided.

The beam model takes half a metre of disagreement for noise, so people and furniture that the map lacks
draw the cloud aside. From the filter's estimate, a robust alignment of the end points to the nearest walls
finds the pose that most of the scan agrees with.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from localization.beams import Beams
from localization.refinement_kernels import align_to_walls
from maps.distance_field import distance_to_occupied
from maps.occupancy_grid import OccupancyGrid
from maps.se2 import Pose, compose, inverse, transform_points

_FEWEST_POINTS = 10
_FARTHEST = 0.5
"""Metres or radians that an estimate may be moved."""


@dataclass(frozen=True, eq=False)
class Walls:
    """How far it is to the nearest wall."""

    grid: OccupancyGrid
    distances: NDArray[np.float32]
    """(rows, columns) metres from a cell's centre to that of the nearest occupied cell."""


def find_walls(grid: OccupancyGrid) -> Walls:
    """The walls of a map."""
    return Walls(grid, distance_to_occupied(grid))


def refine(map_from_base: Pose, beams: Beams, walls: Walls) -> Pose:
    """The pose (3,) near an estimate (3,) where most end points lie on walls, or else the estimate."""
    is_return = np.isfinite(beams.ranges)
    if np.count_nonzero(is_return) < _FEWEST_POINTS:
        return map_from_base
    ranges, bearings = beams.ranges[is_return], beams.bearings[is_return]
    points_in_laser = np.column_stack([ranges * np.cos(bearings), ranges * np.sin(bearings)])
    points_in_base = transform_points(beams.base_from_laser, points_in_laser)
    grid_from_map = inverse(walls.grid.map_from_grid)
    start = compose(grid_from_map, map_from_base)
    aligned = align_to_walls(start, points_in_base, walls.distances, walls.grid.resolution)
    refined = compose(walls.grid.map_from_grid, aligned)
    is_near = np.all(np.abs(aligned - start)[:2] < _FARTHEST) and abs(aligned[2] - start[2]) < _FARTHEST
    return refined if is_near else map_from_base
