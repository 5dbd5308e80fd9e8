"""Occupancy grid: how certainly each cell is occupied."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, compose
from racecar.maps.grid.raster import Raster

UNKNOWN = -1
FREE = 0
OCCUPIED = 100
OCCUPIED_FROM = 50
"""Percent from which a cell is an obstacle and stops a ray."""
FREE_THRESHOLD = 0.196
"""Probability up to which a cell is free, since ``map_server`` uses this value."""


@dataclass(frozen=True, eq=False)
class OccupancyGrid(Raster):
    """Occupancy grid in the convention of ``nav_msgs/OccupancyGrid``."""

    cells: NDArray[np.int8]
    """(rows, columns): -1 unknown, else percent occupied, 0 to 100. Row 0 is at the origin, rows go up y."""
    resolution: float
    """Metres per cell."""
    map_from_grid: Pose
    """(3,) pose of the outer corner of cell (0, 0); any yaw is allowed (MIT's maps have 3.14)."""

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        rows, columns = self.cells.shape
        return rows, columns

    def moved(self, new_from_map: Pose) -> "OccupancyGrid":
        """The same cells in another map frame."""
        return OccupancyGrid(self.cells, self.resolution, compose(new_from_map, self.map_from_grid))

    def rows(self, first: int, until: int) -> NDArray[np.int8]:
        """(until - first, columns) cells of a range of rows."""
        return self.cells[first:until]
