"""The geometry of a raster, independent of how its cells are stored."""

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecar.maps.geometry.given_arrays import as_array
from racecar.maps.geometry.se2 import Pose, inverse, transform_points


class Raster(ABC):
    """Rows and columns of cells, percent occupied or unknown."""

    resolution: float
    """Metres per cell."""
    map_from_grid: Pose
    """(3,) pose of the outer corner of cell (0, 0); any yaw is allowed (MIT's maps have 3.14)."""

    @property
    @abstractmethod
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""

    @abstractmethod
    def rows(self, first: int, until: int) -> NDArray[np.int8]:
        """(until - first, columns) cells of a range of rows."""

    @property
    def size(self) -> int:
        """Number of cells."""
        rows, columns = self.shape
        return rows * columns

    @property
    def metres(self) -> tuple[float, float]:
        """Width and height."""
        rows, columns = self.shape
        return columns * self.resolution, rows * self.resolution

    def coarser(self, most_cells: int) -> float:
        """Finest resolution, in whole centimetres, at which the same area has at most ``most_cells``
        cells."""
        return float(np.ceil(100.0 * self.resolution * np.sqrt(self.size / most_cells))) / 100.0

    def cell_of(self, points_in_map: ArrayLike) -> NDArray[np.int64]:
        """(N, 2) row and column of points (N, 2), which may lie outside the grid."""
        points_in_grid = transform_points(inverse(self.map_from_grid), _pairs(points_in_map, "Points"))
        return np.floor(points_in_grid[:, ::-1] / self.resolution).astype(np.int64)

    def raster_of(self, points_in_map: ArrayLike) -> NDArray[np.float64]:
        """(N, 2) fractional row and column of points (N, 2); 0 is the centre of the first cell."""
        points_in_grid = transform_points(inverse(self.map_from_grid), _pairs(points_in_map, "Points"))
        raster: NDArray[np.float64] = points_in_grid[:, ::-1] / self.resolution - 0.5
        return raster

    def center_of(self, cells: ArrayLike) -> NDArray[np.float64]:
        """(N, 2) centres in the map frame of cells (N, 2) given as row and column."""
        points_in_grid = (_pairs(cells, "Cells")[:, ::-1] + 0.5) * self.resolution
        return transform_points(self.map_from_grid, points_in_grid)

    def contains(self, cells: ArrayLike) -> NDArray[np.bool_]:
        """(N,) whether cells (N, 2) lie on the grid."""
        cells = np.asarray(cells)
        inside: NDArray[np.bool_] = np.all((cells >= 0) & (cells < np.array(self.shape)), axis=1)
        return inside


def _pairs(values: ArrayLike, what: str) -> NDArray[np.float64]:
    """(N, 2) numbers. Raises UserError when they are not."""
    return as_array(values, f"{what} of a grid", (None, 2))
