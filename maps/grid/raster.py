"""Cells over the plane: where they lie, whatever they hold and however that is kept."""

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecar.maps.geometry.se2 import Pose, inverse, transform_points


class Raster(ABC):
    """Rows and columns of cells, percent occupied or unknown."""

    resolution: float
    """Metres per cell."""
    map_from_grid: Pose
    """(3,) pose of the outer corner of cell (0, 0); the yaw may be any (MIT's maps have 3.14)."""

    @property
    @abstractmethod
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""

    @abstractmethod
    def rows(self, first: int, until: int) -> NDArray[np.int8]:
        """(until - first, columns) cells of some rows."""

    @property
    def size(self) -> int:
        """How many cells there are."""
        rows, columns = self.shape
        return rows * columns

    @property
    def metres(self) -> tuple[float, float]:
        """Width and height."""
        rows, columns = self.shape
        return columns * self.resolution, rows * self.resolution

    def coarser(self, most_cells: int) -> float:
        """Metres per cell, in whole centimetres, of which the same ground has so many at most."""
        return float(np.ceil(100.0 * self.resolution * np.sqrt(self.size / most_cells))) / 100.0

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
        inside: NDArray[np.bool_] = np.all((cells >= 0) & (cells < np.array(self.shape)), axis=1)
        return inside
