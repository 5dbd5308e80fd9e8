"""Expected ranges, computed beforehand for every free cell and heading, a byte each."""

import logging
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_cdt

from localization.free_space import FreeSpace
from localization.range_table_kernels import MOVABLE, OBSTACLE, fill_heading, transpose_block
from maps.occupancy_grid import OCCUPIED_FROM

_log = logging.getLogger(__name__)

HEADINGS = 320
"""More would cost memory and tell little: of rays at random, 5 % are then off by over 3 cells, of 512 4 %."""
_FEWEST_HEADINGS = 128
_BLOCK = 32
"""Headings filled one after the other before they are sorted in by cell, half a cache line at a time; those
behind are filled with those ahead, so that headings come in twice as many."""


@dataclass(frozen=True, eq=False)
class RangeTable:
    """How far the nearest obstacle is from each free cell in each direction, as `range_codes` has it.

    From a cell of an obstacle that can be moved, it is the nearest one behind that.
    """

    ranges: NDArray[np.uint8]
    """(cells, headings); heading h looks along 2π·h/headings over the grid."""
    cell_index: NDArray[np.int32]
    """(rows, columns) row of ``ranges`` for each cell of the grid, negative where the car cannot be."""

    @property
    def headings(self) -> int:
        """A multiple of 64."""
        return int(self.ranges.shape[1])


def build_range_table(free_space: FreeSpace, max_megabytes: int) -> RangeTable | None:
    """The table of a map, with 320 headings or, to stay within the limit, fewer; None when it has too few."""
    cell_count = int(np.count_nonzero(free_space.is_standable))
    affordable = max_megabytes * 10**6 // cell_count
    headings = min(HEADINGS, affordable - affordable % (2 * _BLOCK))
    if headings < _FEWEST_HEADINGS:
        needed = -(-cell_count * _FEWEST_HEADINGS // 10**6)
        _log.warning(
            "A range table of the map's %d free cells takes %d MB and table_megabytes is %d: rays are cast "
            "one by one, which takes some fifty times as long.",
            cell_count,
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
    cell_index = _cell_codes(free_space)
    codes = np.where(free_space.is_movable, cell_index + MOVABLE, cell_index)
    return RangeTable(_fill(codes, cell_count, headings), cell_index)


def _cell_codes(free_space: FreeSpace) -> NDArray[np.int32]:
    """(rows, columns) running number of each cell the car can be on, else the kernel's negative codes."""
    is_obstacle = free_space.grid.cells >= OCCUPIED_FROM
    steps_away = distance_transform_cdt(~(is_obstacle | free_space.is_standable), metric="chessboard")
    codes = (OBSTACLE - steps_away).astype(np.int32)
    codes[free_space.is_standable] = np.arange(np.count_nonzero(free_space.is_standable), dtype=np.int32)
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
