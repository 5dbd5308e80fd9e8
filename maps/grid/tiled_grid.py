"""An occupancy grid in tiles that exist only where something was seen.

A drive of some kilometres crosses a plane of billions of cells and sees a few per cent of them.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import UNKNOWN, OccupancyGrid
from racecar.maps.grid.raster import Raster

TILE = 256
"""Cells along a tile's side. Chosen by judgement: a room or two, with few unseen cells around it."""
_MOST_CELLS = 1_000_000_000
"""Most cells of a grid in one piece: a gigabyte, and whoever works on it needs several more."""


class Tile(NamedTuple):
    """Column and row of a tile, counted from the tile with cell (0, 0)."""

    row: int
    column: int

    @property
    def first_cell(self) -> tuple[int, int]:
        """Row and column of its first cell."""
        return self.row * TILE, self.column * TILE


@dataclass(frozen=True, eq=False)
class TiledGrid(Raster):
    """Tiled storage for the cells of an `OccupancyGrid`."""

    tiles: dict[Tile, NDArray[np.int8]]
    """(TILE, TILE) each. Tiles at the upper and right edge reach beyond the grid and are cut off there."""
    height: int
    """Number of rows."""
    width: int
    """Number of columns."""
    resolution: float
    """Metres per cell."""
    map_from_grid: Pose
    """(3,) pose of the outer corner of cell (0, 0)."""
    elsewhere: int = UNKNOWN
    """Value of cells without a tile."""

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.height, self.width

    def rows(self, first: int, until: int) -> NDArray[np.int8]:
        """(until - first, columns) cells of a range of rows."""
        return self.window(slice(first, until), slice(0, self.width))

    def window(self, rows: slice, columns: slice) -> NDArray[np.int8]:
        """Cells in a range of rows and columns, which may reach beyond the grid."""
        cells = np.full((rows.stop - rows.start, columns.stop - columns.start), self.elsewhere, dtype=np.int8)
        for tile in tiles_in(rows, columns):
            if tile in self.tiles:
                row, column = tile.first_cell
                above, right = max(row, rows.start), max(column, columns.start)
                part = self.tiles[tile][above - row : rows.stop - row, right - column : columns.stop - column]
                place = (above - rows.start, right - columns.start)
                cells[place[0] : place[0] + part.shape[0], place[1] : place[1] + part.shape[1]] = part
        return cells

    def tile(self, tile: Tile) -> NDArray[np.int8]:
        """(TILE, TILE) the cells of a tile."""
        row, column = tile.first_cell
        return self.window(slice(row, row + TILE), slice(column, column + TILE))

    def in_one_piece(self) -> OccupancyGrid:
        """The same grid as one array. Raises UserError when it has too many cells."""
        if self.size > _MOST_CELLS:
            raise UserError(
                f"A map of {self.width} × {self.height} cells is too large to be held in one piece; draw it "
                f"with cells of {self.coarser(_MOST_CELLS):g} m (--resolution), or a part of it (--crop)."
            )
        return OccupancyGrid(self.rows(0, self.height), self.resolution, self.map_from_grid)


def tiles_in(rows: slice, columns: slice) -> Iterator[Tile]:
    """Tiles that hold cells in a range of rows and columns."""
    for row in range(rows.start // TILE, -(-rows.stop // TILE)):
        for column in range(columns.start // TILE, -(-columns.stop // TILE)):
            yield Tile(row, column)
