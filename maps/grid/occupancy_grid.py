"""Occupancy grid: how certainly each cell is occupied."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.calls import checked
from racecar.maps.errors import UserError
from racecar.maps.geometry.given_arrays import as_array, as_pose
from racecar.maps.geometry.se2 import Pose, compose
from racecar.maps.grid.raster import Raster

UNKNOWN = -1
FREE = 0
OCCUPIED = 100
OCCUPIED_FROM = 50
"""Percent from which a cell is an obstacle and stops a ray."""
FREE_THRESHOLD = 0.196
"""Probability up to which a cell is free, since ``map_server`` uses this value."""
OCCUPIED_THRESHOLD = 0.65
"""Probability from which a cell is occupied, likewise."""
_MILLIMETRES = 20.0
"""Metres per cell from which these were millimetres; the coarsest maps, and pictures of huge ones, have less.
Chosen by judgement."""


@checked
@dataclass(frozen=True, eq=False)
class OccupancyGrid(Raster):
    """Occupancy grid in the convention of ``nav_msgs/OccupancyGrid``. Raises UserError when shapes or units
    are wrong."""

    cells: NDArray[np.int8]
    """(rows, columns): -1 unknown, else percent occupied, 0 to 100. Row 0 is at the origin, rows go up y."""
    resolution: float
    """Metres per cell."""
    map_from_grid: Pose
    """(3,) pose of the outer corner of cell (0, 0); any yaw is allowed (MIT's maps have 3.14)."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "cells", _as_cells(self.cells))
        object.__setattr__(self, "map_from_grid", as_pose(self.map_from_grid, "The map_from_grid of a grid"))
        if not 0.0 < self.resolution < _MILLIMETRES:
            raise UserError(
                f"The resolution of a grid is {self.resolution:g}; give the metres that a cell measures, "
                "such as 0.05."
            )

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        rows, columns = self.cells.shape
        return rows, columns

    @property
    def is_occupied(self) -> NDArray[np.bool_]:
        """(rows, columns) whether a cell is occupied, as `save_map` and map_server tell: from 65 %."""
        occupied: NDArray[np.bool_] = self.cells >= round(100 * OCCUPIED_THRESHOLD)
        return occupied

    @property
    def is_free(self) -> NDArray[np.bool_]:
        """(rows, columns) whether a cell is free, likewise: up to 19.6 %."""
        free: NDArray[np.bool_] = (self.cells != UNKNOWN) & (self.cells <= int(100 * FREE_THRESHOLD))
        return free

    @property
    def is_unknown(self) -> NDArray[np.bool_]:
        """(rows, columns) whether a cell is neither: nobody has seen it, or it was seen both ways."""
        return ~(self.is_occupied | self.is_free)

    def _repr_html_(self) -> str:
        from racecar.maps.grid.html_picture import html_picture

        (rows, columns), (width, height) = self.shape, self.metres
        size = f"{width:.1f} × {height:.1f} m, {rows} rows and {columns} columns of {self.resolution:g} m"
        return f"<p>{size}</p>{html_picture(self)}"

    def moved(self, new_from_map: Pose) -> "OccupancyGrid":
        """The same cells in another map frame."""
        return OccupancyGrid(self.cells, self.resolution, compose(new_from_map, self.map_from_grid))

    def rows(self, first: int, until: int) -> NDArray[np.int8]:
        """(until - first, columns) cells of a range of rows."""
        return self.cells[first:until]


def _as_cells(cells: NDArray[np.int8]) -> NDArray[np.int8]:
    """(rows, columns) percent occupied. Raises UserError for anything else, such as probabilities."""
    if isinstance(cells, np.ndarray) and cells.dtype == np.int8:
        return as_array(cells, "The cells of a grid", (None, None), np.int8)
    given = as_array(cells, "The cells of a grid, in percent,", (None, None), np.int64)
    if np.asarray(cells).dtype == np.bool_:
        raise UserError("The cells of a grid are true or false; give percent occupied, such as 100 * cells.")
    if given.size and not UNKNOWN <= given.min() <= given.max() <= OCCUPIED:
        raise UserError(
            f"The cells of a grid reach from {given.min()} to {given.max()}; give percent occupied, 0 to "
            "100, and -1 for unknown."
        )
    return given.astype(np.int8)
