"""The occupancy grid: what is known of each cell of the floor."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecar.maps.geometry.se2 import Pose, inverse, transform_points

UNKNOWN = -1
FREE = 0
OCCUPIED = 100
OCCUPIED_FROM = 50
"""Percent; a cell at least this occupied is an obstacle and stops a ray."""
FREE_THRESHOLD = 0.196
"""Probability up to which a cell is free, since ``map_server`` draws it so."""


@dataclass(frozen=True, eq=False)
class OccupancyGrid:
    """Cells over the plane, in the convention of ``nav_msgs/OccupancyGrid``."""

    cells: NDArray[np.int8]
    """(rows, columns): -1 unknown, else percent occupied, 0 to 100. Row 0 is at the origin, rows go up y."""
    resolution: float
    """Metres per cell."""
    map_from_grid: Pose
    """(3,) pose of the outer corner of cell (0, 0); the yaw may be any (MIT's maps have 3.14)."""

    def cell_of(self, points_in_map: ArrayLike) -> NDArray[np.int64]:
        """(N, 2) row and column of points (N, 2); they may lie outside the grid."""
        points_in_grid = transform_points(inverse(self.map_from_grid), points_in_map)
        return np.floor(points_in_grid[:, ::-1] / self.resolution).astype(np.int64)

    def raster_of(self, points_in_map: ArrayLike) -> NDArray[np.float64]:
        """(N, 2) row and column of points (N, 2), fractions and all; 0 is the middle of the first cell."""
        points_in_grid = transform_points(inverse(self.map_from_grid), points_in_map)
        raster: NDArray[np.float64] = points_in_grid[:, ::-1] / self.resolution - 0.5
        return raster

    def center_of(self, cells: ArrayLike) -> NDArray[np.float64]:
        """(N, 2) centres in the map frame of cells (N, 2), row and column."""
        points_in_grid = (np.asarray(cells, dtype=np.float64)[:, ::-1] + 0.5) * self.resolution
        return transform_points(self.map_from_grid, points_in_grid)

    def contains(self, cells: ArrayLike) -> NDArray[np.bool_]:
        """(N,) whether cells (N, 2) lie on the grid."""
        cells = np.asarray(cells)
        inside: NDArray[np.bool_] = np.all((cells >= 0) & (cells < np.array(self.cells.shape)), axis=1)
        return inside
