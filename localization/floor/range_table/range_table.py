"""Expected ranges, computed beforehand for every free cell and heading, a byte each."""

import logging
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.localization.floor.free_space import FreeSpace
from racecar.localization.floor.range_table.column_view import MOVABLE, OPEN, WALL, view_columns
from racecar.localization.floor.range_table.range_codes import CODE_OF_CELLS, FARTHEST
from racecar.localization.floor.range_table.range_table_kernels import sweep
from racecar.localization.floor.range_table.viewpoints import choose_viewpoints
from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM

_log = logging.getLogger(__name__)

HEADINGS = 832
"""Of rays at random, 2 to 5 % are then off by over 3 cells; of 640 it would be half a hundredth more."""
_FEWEST_HEADINGS = 128
_FEWER_BY = 32
"""Headings: an eighth of a circle has whole ones, and a row of the table whole halves of cache lines."""


@dataclass(frozen=True, eq=False)
class RangeTable:
    """How far the nearest obstacle is from each viewpoint in each direction, as `range_codes` has it.

    From within an obstacle that can be moved, it is the nearest one behind that.
    """

    ranges: NDArray[np.uint8]
    """(R, headings) from R viewpoints; heading h looks along 2π·h/headings over the grid."""
    cell_index: NDArray[np.int32]
    """(rows, columns) row of ``ranges`` for each cell of the grid, negative where the car cannot be."""
    viewpoints: NDArray[np.float32]
    """(R, 2) row and column, in cells from the grid's corner, that each row of ``ranges`` was seen from."""

    @property
    def headings(self) -> int:
        """A multiple of 32."""
        return int(self.ranges.shape[1])


def affordable_cells(max_megabytes: int) -> int:
    """How many free cells, four to a viewpoint, a table with all headings may have."""
    return 4 * max_megabytes * 10**6 // HEADINGS


def build_range_table(free_space: FreeSpace, max_megabytes: int) -> RangeTable | None:
    """The table of a map, with 832 headings or, to stay within the limit, fewer; None when it has too few."""
    cell_index, viewpoints = choose_viewpoints(free_space)
    affordable = max_megabytes * 10**6 // len(viewpoints)
    headings = min(HEADINGS, affordable - affordable % _FEWER_BY)
    if headings < _FEWEST_HEADINGS:
        needed = -(-len(viewpoints) * _FEWEST_HEADINGS // 10**6)
        _log.warning(
            "A range table of the map's %d free cells takes %d MB and table_megabytes is %d: rays are cast "
            "one by one, which takes some fifty times as long.",
            free_space.cell_count,
            needed,
            max_megabytes,
        )
        return None
    if headings < HEADINGS:
        _log.warning(
            "The range table has %d headings instead of %d, to stay within table_megabytes, which is %d.",
            headings,
            HEADINGS,
            max_megabytes,
        )
    return RangeTable(_fill(_kinds(free_space), viewpoints, headings), cell_index, viewpoints)


def _kinds(free_space: FreeSpace) -> NDArray[np.uint8]:
    """(rows, columns) of cells."""
    kinds = np.where(free_space.grid.cells >= OCCUPIED_FROM, WALL, OPEN).astype(np.uint8)
    kinds[free_space.is_movable] = MOVABLE
    return kinds


def _fill(kinds: NDArray[np.uint8], viewpoints: NDArray[np.float32], headings: int) -> NDArray[np.uint8]:
    """(R, headings): sweep the grid along each direction, by columns or, where they are steeper, by rows."""
    by_column, by_row = view_columns(kinds.T, viewpoints[:, ::-1]), view_columns(kinds, viewpoints)
    ranges = np.empty((len(viewpoints), headings), dtype=np.uint8)
    for octant, angles in enumerate(2.0 * np.pi * np.arange(headings).reshape(8, -1) / headings):
        is_steep = octant % 4 in (1, 2)
        view = by_row if is_steep else by_column
        seen = np.empty((len(angles), len(viewpoints)), dtype=np.uint8)
        for i, (cos, sin) in enumerate(zip(np.cos(angles), np.sin(angles), strict=True)):
            along, across = (sin, cos) if is_steep else (cos, sin)
            is_forward = along < 0  # what lies ahead is what a line has passed that comes from there
            sweep(view, across / along, is_forward, _codes_of_half_columns(1.0 / abs(along)), seen[i])
        ranges[view.numbers, octant * len(angles) : (octant + 1) * len(angles)] = seen.T
    return ranges


def _codes_of_half_columns(stretch: float) -> NDArray[np.uint8]:
    """Of distances along lines that are longer by a factor than the columns that they pass."""
    cells = 0.5 * stretch * np.arange(2 * FARTHEST + 1)
    codes: NDArray[np.uint8] = CODE_OF_CELLS[np.minimum(cells + 0.5, FARTHEST).astype(np.int64)]
    return codes
