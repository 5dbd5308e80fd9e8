"""Ranges that a laser would measure in a map, exact to the cell's edge.

A cell stops a ray when it is at least half occupied (``OCCUPIED_FROM``); unknown cells are looked through.
A ray that starts in an occupied cell measures 0; one that meets nothing measures inf.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecar.maps.geometry.se2 import Pose, between
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.ray_casting_kernels import cast_beams, cast_fans


def cast_ray_fan(
    grid: OccupancyGrid, map_from_laser: ArrayLike, bearings: ArrayLike, max_range: float
) -> NDArray[np.float64]:
    """(P, B) metres: all bearings (B,) from each of the poses (P, 3); inf beyond ``max_range``."""
    starts, bearings = in_cells(grid, map_from_laser), np.ascontiguousarray(bearings, dtype=np.float64)
    distances = np.empty((len(starts), len(bearings)))
    cast_fans(grid.cells, starts, bearings, max_range / grid.resolution, distances)
    return distances * grid.resolution


def cast_rays(
    grid: OccupancyGrid, map_from_laser: ArrayLike, bearings: ArrayLike, max_range: float
) -> NDArray[np.float64]:
    """(N,) metres: bearing i of (N,) from pose i of (N, 3) or all from one (3,); inf beyond ``max_range``.

    With a pose for each bearing a sweep is cast from a moving laser.
    """
    bearings = np.ascontiguousarray(bearings, dtype=np.float64)
    starts = np.broadcast_to(in_cells(grid, map_from_laser), (len(bearings), 3))
    distances = np.empty(len(bearings))
    cast_beams(grid.cells, np.ascontiguousarray(starts), bearings, max_range / grid.resolution, distances)
    return distances * grid.resolution


def in_cells(grid: OccupancyGrid, map_from_laser: ArrayLike) -> Pose:
    """(..., 3) row and column in cells, fractions and all, and heading over the grid of poses (..., 3)."""
    grid_from_laser = between(grid.map_from_grid, map_from_laser)
    starts = grid_from_laser[..., [1, 0, 2]] / np.array([grid.resolution, grid.resolution, 1.0])
    return np.ascontiguousarray(starts)
