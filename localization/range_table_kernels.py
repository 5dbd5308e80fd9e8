"""The sweeps that fill the range table."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

OPEN, WALL, MOVABLE = 0, 1, 2
"""Kinds of cells: rays go through, they end here, they end here unless they start within."""


@njit(cache=True, nogil=True)
def sweep(
    kinds: NDArray[np.uint8],
    has_movable: NDArray[np.bool_],
    first: NDArray[np.int64],
    rows_of_viewpoints: NDArray[np.int64],
    is_corner: NDArray[np.int64],
    numbers: NDArray[np.int64],
    slope: float,
    is_forward: bool,
    codes: NDArray[np.uint8],
    seen: NDArray[np.uint8],
) -> None:
    """What all viewpoints see when they look back along the direction (columns, rows) = (1, slope).

    All parallel lines, one through each row, go on together from column to column, so that they cover every
    cell once (|slope| <= 1), and remember the last obstacle that they passed. If not forward, they come from
    the other end. ``kinds`` are (columns, rows), ``has_movable`` (columns,). The viewpoints of column c are
    ``first[c]`` to before ``first[c + 1]``. Each is in the middle of a row's cell, or on its far corner,
    around which all is open; it has a number, under which ``seen`` gets one of the ``codes`` of distances in
    half columns. The last of these stands for all that are longer.
    """
    columns, rows = kinds.shape
    climbs = np.empty(columns, dtype=np.int64)
    for column in range(columns):
        climbs[column] = math.floor(0.5 + slope * column)
    highest = max(climbs[0], climbs[columns - 1])
    farthest = len(codes) - 1
    onward = 1 if is_forward else -1
    nowhere = -farthest if is_forward else 2 * columns + farthest
    passed = np.full(rows + abs(climbs[columns - 1] - climbs[0]), nowhere, dtype=np.int32)
    beyond = passed.copy()
    for step in range(columns):
        column = step if is_forward else columns - 1 - step
        line = highest - climbs[column]
        if step > 0:
            left = min(column, column - onward)
            _pass_corners(
                kinds[left],
                kinds[left + 1],
                climbs[left + 1] - climbs[left],
                slope,
                left,
                0.5 + slope * left - climbs[left],
                passed[highest - climbs[left] :],
            )
            if has_movable[column]:
                before = column - onward
                _enter_movable(
                    kinds[before],
                    kinds[column],
                    climbs[column] - climbs[before],
                    passed[line:],
                    beyond[line:],
                )
        height_at_corner = 0.5 + slope * (column + 0.5) - climbs[column]
        next_line = 1 if height_at_corner < 0.5 else 0  # whichever passes the corner more closely
        for viewpoint in range(first[column], first[column + 1]):
            row, corner = rows_of_viewpoints[viewpoint], is_corner[viewpoint]
            at = line + row + corner * next_line
            obstacle = beyond[at] if kinds[column, row] == MOVABLE else passed[at]
            seen[numbers[viewpoint]] = codes[min(onward * (2 * column + corner - obstacle), farthest)]
        _pass_cells(kinds[column], 2 * column + onward, passed[line:])


@njit(cache=True, nogil=True)
def _pass_cells(here: NDArray[np.uint8], far_side: int, passed: NDArray[np.int32]) -> None:
    """Remember the far side, in half columns, of obstacles in a column (rows,)."""
    side = np.int32(far_side)
    for row in range(len(here)):
        passed[row] = side if here[row] != OPEN else passed[row]


@njit(cache=True, nogil=True)
def _pass_corners(
    left: NDArray[np.uint8],
    right: NDArray[np.uint8],
    climb: int,
    slope: float,
    column: int,
    height: float,
    passed: NDArray[np.int32],
) -> None:
    """Remember the obstacles whose corners lines cut on the way between two columns (rows,).

    Lines that climb a row pass a third cell in between: the one above, or below, in the left ``column`` if
    their ``height`` in the cell (0 to 1) lets them leave it there, else the one beside in the right.
    """
    if climb == 0:
        return
    low, end = max(0, -climb), len(left) - max(0, climb)
    from_here, into = left[low:end], right[low + climb : end + climb]
    corners = left[low + climb : end + climb] if math.floor(height + 0.5 * slope) == climb else right[low:end]
    lines = passed[low:end]
    side = np.int32(2 * column + 1)
    for i in range(len(lines)):
        stays_outside = (from_here[i] != MOVABLE) & (into[i] != MOVABLE)
        blocks = (corners[i] == WALL) | ((corners[i] == MOVABLE) & stays_outside)
        lines[i] = side if blocks else lines[i]


@njit(cache=True, nogil=True)
def _enter_movable(
    before: NDArray[np.uint8],
    here: NDArray[np.uint8],
    climb: int,
    passed: NDArray[np.int32],
    beyond: NDArray[np.int32],
) -> None:
    """Remember what lies before an obstacle that can be moved, where lines come into it."""
    for row in range(len(here)):
        if here[row] == MOVABLE:
            was_outside = not 0 <= row - climb < len(before) or before[row - climb] != MOVABLE
            if was_outside:
                beyond[row] = passed[row]


@njit(cache=True, nogil=True)
def transpose_block(block: NDArray[np.uint8], ranges: NDArray[np.uint8], first_heading: int) -> None:
    """Sort ranges (headings, R) into columns ``first_heading`` and on of the table (R, headings)."""
    headings, viewpoints = block.shape
    tile = 64
    for tile_start in range(0, viewpoints, tile):
        for heading in range(headings):
            for viewpoint in range(tile_start, min(tile_start + tile, viewpoints)):
                ranges[viewpoint, first_heading + heading] = block[heading, viewpoint]
