"""Expected ranges, computed beforehand for every free cell and heading, a byte each."""

import logging
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from localization.free_space import FreeSpace
from localization.range_codes import CODE_OF_CELLS, FARTHEST
from localization.range_table_kernels import MOVABLE, OPEN, WALL, sweep, transpose_block
from localization.viewpoints import choose_viewpoints
from maps.occupancy_grid import OCCUPIED_FROM

_log = logging.getLogger(__name__)

HEADINGS = 832
"""Of rays at random, 2 to 5 % are then off by over 3 cells; of 640 it would be half a hundredth more."""
_FEWEST_HEADINGS = 128
_BLOCK = 32
"""Headings filled one after the other before they are sorted in by viewpoint, half a cache line at a time."""


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
    headings = min(HEADINGS, affordable - affordable % _BLOCK)
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


@dataclass(frozen=True, eq=False)
class _View:
    """The grid as the sweeps along its columns need it."""

    kinds: NDArray[np.uint8]
    """(columns, rows)"""
    has_movable: NDArray[np.bool_]
    """(columns,)"""
    first: NDArray[np.int64]
    """(columns + 1,) into the next three, for the viewpoints of each column."""
    rows: NDArray[np.int64]
    """(R,) of the viewpoints' cells."""
    is_corner: NDArray[np.int64]
    """(R,) 1 where a viewpoint is on the far corner of its cell, 0 in the middle."""
    numbers: NDArray[np.int64]
    """(R,)"""


def _view(kinds: NDArray[np.uint8], viewpoints: NDArray[np.float32]) -> _View:
    """From kinds of cells (columns, rows) and viewpoints (R, 2) of column and row."""
    cells = np.ceil(viewpoints).astype(np.int64) - 1
    numbers = np.argsort(cells[:, 0], kind="stable")
    first = np.searchsorted(cells[numbers, 0], np.arange(len(kinds) + 1))
    is_corner = (viewpoints[numbers, 0] % 1.0 == 0.0).astype(np.int64)
    has_movable = (kinds == MOVABLE).any(axis=1)
    return _View(np.ascontiguousarray(kinds), has_movable, first, cells[numbers, 1], is_corner, numbers)


def _kinds(free_space: FreeSpace) -> NDArray[np.uint8]:
    """(rows, columns) of cells."""
    kinds = np.where(free_space.grid.cells >= OCCUPIED_FROM, WALL, OPEN).astype(np.uint8)
    kinds[free_space.is_movable] = MOVABLE
    return kinds


def _fill(kinds: NDArray[np.uint8], viewpoints: NDArray[np.float32], headings: int) -> NDArray[np.uint8]:
    """Sweep the grid along each direction and back."""
    by_row, by_column = _view(kinds, viewpoints), _view(kinds.T, viewpoints[:, ::-1])
    ranges = np.empty((len(viewpoints), headings), dtype=np.uint8)
    block = np.empty((_BLOCK, len(viewpoints)), dtype=np.uint8)
    for first in range(0, headings, _BLOCK):
        for i in range(_BLOCK):
            angle = 2.0 * np.pi * (first + i) / headings
            cos, sin = np.cos(angle), np.sin(angle)
            view, along, across = (by_row, sin, cos) if abs(sin) > abs(cos) else (by_column, cos, sin)
            sweep(
                view.kinds,
                view.has_movable,
                view.first,
                view.rows,
                view.is_corner,
                view.numbers,
                across / along,
                along < 0,  # what lies ahead is what a line has passed that comes from there
                _codes_of_half_columns(np.hypot(1.0, across / along)),
                block[i],
            )
        transpose_block(block, ranges, first)
    return ranges


def _codes_of_half_columns(stretch: float) -> NDArray[np.uint8]:
    """Of distances along lines that are longer by a factor than the columns that they pass."""
    cells = 0.5 * stretch * np.arange(2 * FARTHEST + 1)
    codes: NDArray[np.uint8] = CODE_OF_CELLS[np.minimum(cells + 0.5, FARTHEST).astype(np.int64)]
    return codes
