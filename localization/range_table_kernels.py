"""The sweeps that fill the range table."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from localization.range_codes import CODE_OF_CELLS, FARTHEST

OBSTACLE = -1
"""Code of an obstacle; lower codes are cells of no interest, by how far any other kind is from them:
OBSTACLE - k means that it is k columns or rows away."""
MOVABLE = 2**30
"""Added to the code of a cell of an obstacle that can be moved; from there, rays go through it."""


@njit(cache=True, nogil=True)
def fill_heading(
    codes: NDArray[np.int32], slope: float, ahead: NDArray[np.uint8], behind: NDArray[np.uint8]
) -> None:
    """Codes of the ranges of all cells along the direction (columns, rows) = (1, slope) and its opposite.

    Parallel lines, one through each row, cover every cell once (|slope| <= 1). Walking along a line, the
    last obstacle passed is the one that a cell sees behind it, and on the way back the one ahead.
    ``codes`` (rows, columns) hold a cell's place in ``ahead`` and ``behind``, or OBSTACLE or lower; those
    of an obstacle that can be moved have MOVABLE on top, and see what lies beyond it.
    """
    rows, columns = codes.shape
    stretch = math.sqrt(1.0 + slope * slope)
    climb = slope * (columns - 1)
    visited = np.empty(columns, dtype=np.int32)
    line = np.empty(columns, dtype=np.int32)
    corner_blocks = np.empty(columns, dtype=np.bool_)
    for start in range(math.floor(min(0.0, -climb)), rows + math.ceil(max(0.0, -climb))):
        column, end = _columns_on_grid(start + 0.5, slope, rows, columns)
        wall = beyond = -1e9
        was_movable = False
        count = 0
        while column < end:
            height = start + 0.5 + slope * column
            row = int(height)
            code = codes[row, column]
            if code < OBSTACLE - 1:
                column += OBSTACLE - 1 - code
                was_movable = False
                continue
            if code >= MOVABLE:
                if not was_movable:
                    beyond = wall
                cells_away = int((column - beyond) * stretch + 0.5)
                behind[code - MOVABLE] = CODE_OF_CELLS[min(cells_away, FARTHEST)]
                wall = column + 0.5
            elif code >= 0:
                behind[code] = CODE_OF_CELLS[min(int((column - wall) * stretch + 0.5), FARTHEST)]
            elif code == OBSTACLE:
                wall = column + 0.5
            was_movable = code >= MOVABLE
            blocks = False
            next_row = int(height + slope)
            if next_row != row and column + 1 < end:
                row_between = int(height + 0.5 * slope)
                column_between = column if row_between == next_row else column + 1
                corner = codes[row_between, column_between]
                if corner >= MOVABLE:
                    blocks = code < MOVABLE and codes[next_row, column + 1] < MOVABLE
                else:
                    blocks = corner == OBSTACLE
                if blocks:
                    wall = column + 0.5
            visited[count], line[count], corner_blocks[count] = column, code, blocks
            count += 1
            column += 1
        wall = beyond = 1e9
        was_movable = False
        for i in range(count - 1, -1, -1):
            code, column = line[i], visited[i]
            if corner_blocks[i]:
                wall = column + 0.5
            if code >= MOVABLE:
                if not was_movable:
                    beyond = wall
                cells_away = int((beyond - column) * stretch + 0.5)
                ahead[code - MOVABLE] = CODE_OF_CELLS[min(cells_away, FARTHEST)]
                wall = column - 0.5
            elif code >= 0:
                ahead[code] = CODE_OF_CELLS[min(int((wall - column) * stretch + 0.5), FARTHEST)]
            elif code == OBSTACLE:
                wall = column - 0.5
            was_movable = code >= MOVABLE


@njit(cache=True, nogil=True)
def _columns_on_grid(height: float, slope: float, rows: int, columns: int) -> tuple[int, int]:
    """First column and one past the last where 0 <= height + slope * column < rows."""
    first, end = 0, columns
    if slope != 0.0:
        at_bottom, at_top = -height / slope, (rows - height) / slope
        first = int(min(max(min(at_bottom, at_top) - 1.0, 0.0), columns))
        end = int(min(max(max(at_bottom, at_top) + 2.0, 0.0), columns))
    while first < end and not 0.0 <= height + slope * first < rows:
        first += 1
    while end > first and not 0.0 <= height + slope * (end - 1) < rows:
        end -= 1
    return first, end


@njit(cache=True, nogil=True)
def transpose_block(block: NDArray[np.uint8], ranges: NDArray[np.uint8], first_heading: int) -> None:
    """Sort ranges (headings, cells) into columns ``first_heading`` and on of the table (cells, headings)."""
    headings, cells = block.shape
    tile = 64
    for tile_start in range(0, cells, tile):
        for heading in range(headings):
            for cell in range(tile_start, min(tile_start + tile, cells)):
                ranges[cell, first_heading + heading] = block[heading, cell]
