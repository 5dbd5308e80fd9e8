"""A map as the sweeps that fill the range table go through it: column by column."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

OPEN, WALL, MOVABLE = 0, 1, 2
"""Kinds of cells: rays go through, they end here, they end here unless they start within."""


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
