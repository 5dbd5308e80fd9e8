"""The sweeps that fill the range table, and the map as they go through it: column by column."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

OPEN, WALL, MOVABLE = 0, 1, 2
"""Kinds of cells by definition: rays go through, they end here, they end here unless they start within."""


class ColumnView(NamedTuple):
    """What is in each column; column c has movable cells, or viewpoints, ``first[c]`` to ``first[c + 1]``."""

    kinds: NDArray[np.uint8]
    """(columns, rows) of cells."""
    first_movable: NDArray[np.int64]
    """(columns + 1,)"""
    movable_rows: NDArray[np.int32]
    """(M,) of the cells that are movable."""
    first_viewpoint: NDArray[np.int64]
    """(columns + 1,)"""
    viewpoint_rows: NDArray[np.int32]
    """(R,) of the viewpoints' cells."""
    is_corner: NDArray[np.uint8]
    """(R,) 1 for one on the far corner of its cell, around which all is open; 0 for one in the middle."""
    is_inside: NDArray[np.uint8]
    """(R,) 1 where a viewpoint's cell is movable."""
    numbers: NDArray[np.int64]
    """(R,) of the viewpoints, outside."""


def view_columns(kinds: NDArray[np.uint8], viewpoints: NDArray[np.float32]) -> ColumnView:
    """From kinds of cells (columns, rows), and viewpoints (R, 2), column and row in cells from the corner."""
    cells = np.ceil(viewpoints).astype(np.int32) - 1
    numbers = np.argsort(cells[:, 0], kind="stable")
    column, row = cells[numbers].T
    movable_column, movable_row = np.nonzero(kinds == MOVABLE)
    ends = np.arange(len(kinds) + 1)
    return ColumnView(
        kinds=np.ascontiguousarray(kinds),
        first_movable=np.searchsorted(movable_column, ends),
        movable_rows=movable_row.astype(np.int32),
        first_viewpoint=np.searchsorted(column, ends),
        viewpoint_rows=np.ascontiguousarray(row),
        is_corner=(viewpoints[numbers, 0] % 1.0 == 0.0).astype(np.uint8),
        is_inside=(kinds[column, row] == MOVABLE).astype(np.uint8),
        numbers=numbers,
    )


@njit(cache=True, nogil=True)
def sweep(
    view: ColumnView, slope: float, is_forward: bool, codes: NDArray[np.uint8], seen: NDArray[np.uint8]
) -> None:
    """What all viewpoints see when they look back along the direction (columns, rows) = (1, slope).

    All parallel lines, one through each row, go on together from column to column, so that they cover every
    cell once (|slope| <= 1), and remember the last obstacle that they passed. If not forward, they come from
    the other end. ``seen`` (R,), in the order of the view, gets one of the ``codes`` of distances in half
    columns. The last of these stands for all that are longer.
    """
    kinds = view.kinds
    columns, rows = kinds.shape
    climbs = np.empty(columns, dtype=np.int64)
    for column in range(columns):
        climbs[column] = math.floor(0.5 + slope * column)
    highest = max(climbs[0], climbs[columns - 1])
    farthest = len(codes) - 1
    onward = 1 if is_forward else -1
    nowhere = -farthest if is_forward else 2 * columns + farthest
    lines = rows + abs(climbs[columns - 1] - climbs[0])
    marks = np.full((2, lines), nowhere, dtype=np.int32)
    passed, beyond = marks[0], marks[1]
    for step in range(columns):
        column = step if is_forward else columns - 1 - step
        line = highest - climbs[column]
        if step > 0:
            before = column - onward
            left = min(column, before)
            _pass_corners(
                kinds[left],
                kinds[left + 1],
                climbs[left + 1] - climbs[left],
                slope,
                left,
                0.5 + slope * left - climbs[left],
                passed[highest - climbs[left] :],
            )
            _enter_movable(
                view.movable_rows[view.first_movable[column] : view.first_movable[column + 1]],
                kinds[before],
                climbs[column] - climbs[before],
                passed[line:],
                beyond[line:],
            )
        height_at_corner = 0.5 + slope * (column + 0.5) - climbs[column]
        next_line = 1 if height_at_corner < 0.5 else 0  # whichever passes the corner more closely
        for viewpoint in range(view.first_viewpoint[column], view.first_viewpoint[column + 1]):
            corner = view.is_corner[viewpoint]
            at = line + view.viewpoint_rows[viewpoint] + corner * next_line
            obstacle = marks[view.is_inside[viewpoint], at]
            seen[viewpoint] = codes[min(onward * (2 * column + corner - obstacle), farthest)]
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
    rows: NDArray[np.int32],
    before: NDArray[np.uint8],
    climb: int,
    passed: NDArray[np.int32],
    beyond: NDArray[np.int32],
) -> None:
    """Remember what lies before obstacles that can be moved, where lines come into them at some rows (M,)."""
    for row in rows:
        was_outside = not 0 <= row - climb < len(before) or before[row - climb] != MOVABLE
        if was_outside:
            beyond[row] = passed[row]
