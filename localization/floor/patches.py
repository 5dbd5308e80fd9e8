"""Connected patches of a map, processed in strips of rows.

NumPy takes eight bytes per cell that it counts or looks up; on a map of 9000 by 9000 cells, that would be 650
MB at a time.
"""

from collections.abc import Iterator
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

_CELLS = 4_000_000
"""Cells of a strip, because 32 MB of memory are negligible compared with the map."""

_Value = TypeVar("_Value", bound=np.generic)


def strips(shape: tuple[int, ...], multiple: int = 1) -> Iterator[slice]:
    """Row ranges of an array; each strip but the last is a ``multiple`` of rows."""
    rows = max(multiple, _CELLS // max(shape[1], 1) // multiple * multiple)
    for first in range(0, shape[0], rows):
        yield slice(first, min(first + rows, shape[0]))


def patch_sizes(labels: NDArray[Any], count: int) -> NDArray[np.int64]:
    """(count + 1,) number of cells per label, 0 to ``count``."""
    sizes = np.zeros(count + 1, dtype=np.int64)
    for rows in strips(labels.shape):
        sizes += np.bincount(labels[rows].ravel(), minlength=count + 1)
    return sizes


def spread(values: NDArray[_Value], labels: NDArray[Any]) -> NDArray[_Value]:
    """(rows, columns) value (count + 1,) of each cell's label."""
    spread_out = np.empty(labels.shape, dtype=values.dtype)
    for rows in strips(labels.shape):
        spread_out[rows] = values[labels[rows]]
    return spread_out
