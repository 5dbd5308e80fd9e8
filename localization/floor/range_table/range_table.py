"""Expected ranges, computed beforehand for every free cell and heading, a byte each."""

import logging
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.localization.floor.config import RangeTableConfig
from racecar.localization.floor.free_space import FreeSpace
from racecar.localization.floor.range_table.range_codes import RANGE_STEP, RangeCodes, range_codes
from racecar.localization.floor.range_table.range_table_kernels import (
    MOVABLE,
    OPEN,
    WALL,
    sweep,
    view_columns,
)
from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM

_log = logging.getLogger(__name__)

_FEWER_BY = 32
"""Headings by which a table is made smaller, since an eighth of a circle then has a whole number of them, and
a row of the table a whole number of half cache lines."""
VIEWPOINT_REACH = 1.5 * np.sqrt(2.0)
"""Cells from a viewpoint to the farthest place that uses it, since it may be the middle of one cell and serve
the other three of a block of two by two."""
_ALL, _ALONE = 0, 1
"""What a viewpoint is for, by definition: all cells of a kind in a block, or (from 1 on) a single cell."""


@dataclass(frozen=True, eq=False)
class RangeTable:
    """How far the nearest obstacle is from each viewpoint in each direction.

    From within an obstacle that can be moved, it is the nearest one behind that. There is one viewpoint for
    two by two cells: from elsewhere in these four, a view is corrected by what the beams read (see
    `sensor.beam_model`), so that fewer places and more headings are the better use of memory.
    """

    codes: RangeCodes
    ranges: NDArray[np.uint8]
    """(R, headings) codes from R viewpoints; heading h looks along 2π·h/headings over the grid."""
    cell_index: NDArray[np.int32]
    """(rows, columns) row of ``ranges`` for each cell of the grid, negative where the car cannot be."""
    viewpoints: NDArray[np.float32]
    """(R, 2) row and column, in cells from the grid's corner, that each row of ``ranges`` was seen from."""

    @property
    def headings(self) -> int:
        """A multiple of 32."""
        return int(self.ranges.shape[1])


def affordable_cells(max_megabytes: int, config: RangeTableConfig) -> int:
    """How many free cells, four to a viewpoint, a table with all headings may have."""
    return 4 * max_megabytes * 10**6 // config.headings


def build_range_table(
    free_space: FreeSpace, max_megabytes: int, config: RangeTableConfig
) -> RangeTable | RangeCodes:
    """The table of a map, with fewer headings to stay within the limit; only its codes where it has too few.

    The sensor model then casts rays, and expresses their ranges in the codes.
    """
    codes, steps_per_cell = range_codes(config.longest_range), free_space.grid.resolution / RANGE_STEP
    fewest_viewpoints = -(-int(np.count_nonzero(free_space.is_standable)) // 4)
    if _affordable_headings(fewest_viewpoints, max_megabytes) < config.fewest_headings:
        _warn_of_casting(free_space, fewest_viewpoints, max_megabytes, config)
        return codes  # before memory is spent on where the viewpoints would be
    cell_index, viewpoints = choose_viewpoints(free_space)
    headings = min(config.headings, _affordable_headings(len(viewpoints), max_megabytes))
    if headings < config.fewest_headings:
        _warn_of_casting(free_space, len(viewpoints), max_megabytes, config)
        return codes
    if headings < config.headings:
        _log.warning(
            "The range table has %d headings instead of %d, to stay within table_megabytes, which is %d.",
            headings,
            config.headings,
            max_megabytes,
        )
    window = _window(viewpoints, free_space.is_open.shape, codes.longest_steps / steps_per_cell)
    seen_from = viewpoints - np.array([window[0].start, window[1].start], dtype=np.float32)
    ranges = _fill(_kinds(free_space)[window], seen_from, headings, codes, steps_per_cell)
    return RangeTable(codes, ranges, cell_index, viewpoints)


def _affordable_headings(viewpoints: int, max_megabytes: int) -> int:
    affordable = max_megabytes * 10**6 // viewpoints
    return affordable - affordable % _FEWER_BY


def _warn_of_casting(
    free_space: FreeSpace, viewpoints: int, max_megabytes: int, config: RangeTableConfig
) -> None:
    _log.warning(
        "A range table of the map's %d free cells takes %d MB and table_megabytes is %d: rays are cast "
        "one by one, which takes some fifty times as long.",
        free_space.cell_count,
        -(-viewpoints * config.fewest_headings // 10**6),
        max_megabytes,
    )


def choose_viewpoints(free_space: FreeSpace) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """(rows, columns) number of the viewpoint of each cell the car can be on, else -1; and where they are.

    That is (R, 2) row and column in cells: the middle of four that the car can be on, or of the first of
    fewer. Cells of a block that only touch at a corner may have a wall between them and have one each, as
    have those inside an obstacle that can be moved and those beside it.
    """
    rows, columns = free_space.is_open.shape
    kinds = np.zeros((rows + rows % 2, columns + columns % 2), dtype=np.int8)
    kinds[:rows, :columns] = np.where(free_space.is_movable, 2, free_space.is_open)
    row, column = np.nonzero(kinds)
    kind = kinds[row, column]
    is_alone = (kinds[row ^ 1, column] != kind) & (kinds[row, column ^ 1] != kind)
    group = np.where(is_alone, _ALONE + 2 * (row % 2) + column % 2, _ALL)
    block = row // 2 * (kinds.shape[1] // 2) + column // 2
    _, first, number, size = np.unique(
        (block * 3 + kind) * 5 + group, return_index=True, return_inverse=True, return_counts=True
    )
    cell_index = np.full((rows, columns), -1, dtype=np.int32)
    cell_index[row, column] = number
    from_corner = np.where(size == 4, 1.0, 0.5)[:, None]
    return cell_index, (np.column_stack([row[first], column[first]]) + from_corner).astype(np.float32)


def _window(viewpoints: NDArray[np.float32], shape: tuple[int, ...], longest: float) -> tuple[slice, slice]:
    """The rows and columns within ``longest`` cells of any viewpoint, where that leaves out most of them."""
    low = np.maximum(viewpoints.min(axis=0) - longest - 2.0, 0.0).astype(np.int64).tolist()
    high = np.minimum(viewpoints.max(axis=0) + longest + 2.0, shape).astype(np.int64).tolist()
    window = slice(low[0], high[0]), slice(low[1], high[1])
    if 2 * (high[0] - low[0]) * (high[1] - low[1]) > shape[0] * shape[1]:
        return slice(0, shape[0]), slice(0, shape[1])
    return window


def _kinds(free_space: FreeSpace) -> NDArray[np.uint8]:
    """(rows, columns) of cells."""
    kinds = np.where(free_space.grid.cells >= OCCUPIED_FROM, WALL, OPEN).astype(np.uint8)
    kinds[free_space.is_movable] = MOVABLE
    return kinds


def _fill(
    kinds: NDArray[np.uint8],
    viewpoints: NDArray[np.float32],
    headings: int,
    codes: RangeCodes,
    steps_per_cell: float,
) -> NDArray[np.uint8]:
    """(R, headings): sweep the grid along each direction, by columns or, where they are steeper, by rows."""
    by_column, by_row = view_columns(kinds.T, viewpoints[:, ::-1]), view_columns(kinds, viewpoints)
    ranges = np.empty((len(viewpoints), headings), dtype=np.uint8)
    angles = (2.0 * np.pi * np.arange(headings) / headings).reshape(8, -1)

    def fill(octant: int) -> None:
        is_steep = octant % 4 in (1, 2)
        view = by_row if is_steep else by_column
        seen = np.empty((angles.shape[1], len(viewpoints)), dtype=np.uint8)
        for i, (cos, sin) in enumerate(zip(np.cos(angles[octant]), np.sin(angles[octant]), strict=True)):
            along, across = (sin, cos) if is_steep else (cos, sin)
            is_forward = along < 0  # what lies ahead is what a line has passed that comes from there
            code_of_half_columns = _code_of_half_columns(1.0 / abs(along), codes, steps_per_cell)
            sweep(view, across / along, is_forward, code_of_half_columns, seen[i])
        ranges[view.numbers, octant * len(seen) : (octant + 1) * len(seen)] = seen.T

    with ThreadPoolExecutor(2) as pool:  # the sweep, which takes most of the time, releases the GIL
        list(pool.map(fill, range(8)))
    return ranges


def _code_of_half_columns(
    length_per_column: float, codes: RangeCodes, steps_per_cell: float
) -> NDArray[np.uint8]:
    """(H,) codes for each number of half columns, along lines ``length_per_column`` cells long in each."""
    columns = int(np.ceil(codes.longest_steps / steps_per_cell))
    steps = 0.5 * length_per_column * np.arange(2 * columns + 1) * steps_per_cell
    code: NDArray[np.uint8] = codes.code_of_steps[
        np.minimum(steps + 0.5, codes.longest_steps).astype(np.int64)
    ]
    return code
