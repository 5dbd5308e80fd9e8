"""Expected ranges, computed beforehand for every free cell and heading, a byte each."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_cdt

from localization.free_space import FreeSpace, find_free_space
from localization.range_table_kernels import OBSTACLE, fill_heading, transpose_block
from maps.errors import UserError
from maps.occupancy_grid import OCCUPIED_FROM, OccupancyGrid

HEADINGS = 320
"""More would cost memory and tell little: of rays at random, 5 % are then off by over 3 cells, of 512 4 %."""
_FEWEST_HEADINGS = 128
_BLOCK = 32
"""Headings filled one after the other before they are sorted in by cell, half a cache line at a time; those
behind are filled with those ahead, so that headings come in twice as many."""


@dataclass(frozen=True, eq=False)
class RangeTable:
    """Distance in cells, at most 200, from each free cell to the nearest obstacle in each direction."""

    ranges: NDArray[np.uint8]
    """(cells, headings); heading h looks along 2π·h/headings over the grid."""
    cell_index: NDArray[np.int32]
    """(rows, columns) row of ``ranges`` for each cell of the grid, negative where the car cannot be."""
    free_space: FreeSpace

    @property
    def headings(self) -> int:
        """A multiple of 64."""
        return int(self.ranges.shape[1])


def build_range_table(grid: OccupancyGrid, max_megabytes: int) -> RangeTable:
    """The table of a map, with 320 headings or, to stay within the limit, fewer.

    Raises UserError when the map has no free cells or too many of them.
    """
    max_bytes = max_megabytes * 10**6
    free_space = find_free_space(grid, max_bytes // HEADINGS)
    affordable = max_bytes // free_space.cell_count
    headings = min(HEADINGS, affordable - affordable % (2 * _BLOCK))
    if headings < _FEWEST_HEADINGS:
        needed = -(-free_space.cell_count * _FEWEST_HEADINGS // 10**6)
        raise UserError(
            f"To localize on the map's {free_space.cell_count} free cells takes {needed} MB of memory and "
            f"table_megabytes is {max_megabytes}; raise it, or mark the outside of the map as unknown."
        )
    codes = _cell_codes(grid, free_space)
    ranges = _fill(codes, free_space.cell_count, headings)
    return RangeTable(ranges, codes, free_space)


def _cell_codes(grid: OccupancyGrid, free_space: FreeSpace) -> NDArray[np.int32]:
    """(rows, columns) running number of each cell the car can be on, else the kernel's negative codes."""
    is_obstacle = grid.cells >= OCCUPIED_FROM
    steps_away = distance_transform_cdt(~(is_obstacle | free_space.is_open), metric="chessboard")
    codes = (OBSTACLE - steps_away).astype(np.int32)
    codes[free_space.is_open] = np.arange(free_space.cell_count, dtype=np.int32)
    return codes


def _fill(codes: NDArray[np.int32], cell_count: int, headings: int) -> NDArray[np.uint8]:
    """Sweep the grid along each direction; opposite headings share a sweep."""
    turned = np.ascontiguousarray(codes.T)
    ranges = np.empty((cell_count, headings), dtype=np.uint8)
    ahead = np.empty((_BLOCK, cell_count), dtype=np.uint8)
    behind = np.empty_like(ahead)
    half = headings // 2
    for first in range(0, half, _BLOCK):
        for i in range(_BLOCK):
            angle = 2.0 * np.pi * (first + i) / headings
            cos, sin = np.cos(angle), np.sin(angle)
            if abs(sin) > abs(cos):
                fill_heading(turned, cos / sin, ahead[i], behind[i])
            elif cos > 0:
                fill_heading(codes, sin / cos, ahead[i], behind[i])
            else:
                fill_heading(codes, sin / cos, behind[i], ahead[i])
        transpose_block(ahead, ranges, first)
        transpose_block(behind, ranges, first + half)
    return ranges
