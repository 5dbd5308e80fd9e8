"""How well a scan fits the walls of a map, which can be measured without knowing the true pose.

A beam ends at the first surface it hits, so an end point deep inside a wall is not on it.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, transform_points
from racecar.maps.grid.distance_field import distance_to_occupied, sample_field
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OCCUPIED_FROM, UNKNOWN, OccupancyGrid
from racecar.sensors.scan import Scan

ON_WALL = 0.10
"""Maximum metres from a wall for an end point to count as on it. Chosen by judgement: two cells of a map of 5
cm, since a wall mapped thick or thin is off by one and the laser by a few centimetres."""


class WallFit:
    """The distance from every cell of a map to the surface of the nearest wall."""

    def __init__(self, grid: OccupancyGrid) -> None:
        self._grid, self._distances = grid, distance_to_surface(grid)

    @property
    def share_of_map(self) -> float:
        """Share of the known cells where an end point would lie on a wall by chance."""
        known = self._grid.cells > UNKNOWN
        near = np.count_nonzero(known & (self._distances <= ON_WALL))
        return float(near / max(int(np.count_nonzero(known)), 1))

    def share(self, scan: Scan, map_from_base: Pose) -> float:
        """Share of a scan's end points that lie on a wall, from a pose (3,); nan if it has none."""
        return self.share_of_points(transform_points(map_from_base, scan.points_in_base()))

    def share_of_points(self, points_in_map: NDArray[np.float64]) -> float:
        """The same for points (N, 2) in the map frame, metres."""
        if not len(points_in_map):
            return float("nan")
        return float(np.mean(sample_field(self._distances, self._grid, points_in_map) <= ON_WALL))


def distance_to_surface(grid: OccupancyGrid) -> NDArray[np.float32]:
    """(rows, columns) metres to the nearest occupied cell, or inside a wall to its nearest surface cell."""
    distances = distance_to_occupied(grid)
    outside = np.where(grid.cells >= OCCUPIED_FROM, np.int8(FREE), np.int8(OCCUPIED))
    if (outside == OCCUPIED).any():
        depth = distance_to_occupied(OccupancyGrid(outside, grid.resolution, grid.map_from_grid))
        np.maximum(distances, depth - np.float32(grid.resolution), out=distances)
    return distances
