"""How well a scan lies on the walls of a map: what can be measured of a pose whose truth is not known.

Beams end on what they meet first, so that an end point deep inside a wall is not on it.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, transform_points
from racecar.maps.grid.distance_field import distance_to_occupied, sample_field
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OCCUPIED_FROM, UNKNOWN, OccupancyGrid
from racecar.sensors.scan import Scan

ON_WALL = 0.10
"""Metres from a wall within which an end point counts as on it: two cells of a map of 5 cm, since a wall that
is mapped thick or thin is off by one and the laser by some centimetres. By judgement."""


class WallFit:
    """Knows how far it is to the surface of the nearest wall from everywhere on a map."""

    def __init__(self, grid: OccupancyGrid) -> None:
        self._grid, self._distances = grid, distance_to_surface(grid)

    @property
    def share_of_map(self) -> float:
        """Share of the cells that are known where an end point would lie on a wall by chance."""
        known = self._grid.cells > UNKNOWN
        near = np.count_nonzero(known & (self._distances <= ON_WALL))
        return float(near / max(int(np.count_nonzero(known)), 1))

    def share(self, scan: Scan, map_from_base: Pose) -> float:
        """Share of a scan's end points that lie on a wall, from a pose (3,); nan when it has none."""
        return self.share_of_points(transform_points(map_from_base, scan.points_in_base()))

    def share_of_points(self, points_in_map: NDArray[np.float64]) -> float:
        """The same of points (N, 2) of the map frame, metres."""
        if not len(points_in_map):
            return float("nan")
        return float(np.mean(sample_field(self._distances, self._grid, points_in_map) <= ON_WALL))


def distance_to_surface(grid: OccupancyGrid) -> NDArray[np.float32]:
    """(rows, columns) metres to the nearest occupied cell, or from inside to the nearest at the surface."""
    distances = distance_to_occupied(grid)
    outside = np.where(grid.cells >= OCCUPIED_FROM, np.int8(FREE), np.int8(OCCUPIED))
    if (outside == OCCUPIED).any():
        depth = distance_to_occupied(OccupancyGrid(outside, grid.resolution, grid.map_from_grid))
        np.maximum(distances, depth - np.float32(grid.resolution), out=distances)
    return distances
