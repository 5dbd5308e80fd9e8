"""The places from which the range table has a view: one for two by two cells.

From elsewhere in these four, a view is corrected by what the beams read (see `sensor.beam_model`), so
that fewer places and more headings are the better use of memory.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.localization.floor.free_space import FreeSpace

_ALL, _ALONE = 0, 1
"""Whom a viewpoint is for: the cells of a kind in a block, or from here on one by itself."""


def choose_viewpoints(free_space: FreeSpace) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """(rows, columns) number of the viewpoint of each cell the car can be on, else -1; and where they are.

    That is (R, 2) row and column in cells: the middle of four that the car can be on, or of the first of
    fewer. Cells of a block that only touch at a corner may have a wall between them and have one each, as
    have those inside an obstacle that can be moved and those beside it.
    """
    rows, columns = free_space.is_open.shape
    kinds = np.zeros((rows + rows % 2, columns + columns % 2), dtype=np.int64)
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
