"""Patches of a map, labelled cell by cell, a strip of rows at a time.

NumPy takes eight bytes for each cell that it counts or looks up; on a map of 9000 by 9000 cells that would be
650 MB a time.
"""

from collections.abc import Iterator
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

_CELLS = 4_000_000
"""Of a strip, because 32 MB of memory for them are nothing beside the map."""

_Value = TypeVar("_Value", bound=np.generic)


def strips(shape: tuple[int, ...], multiple: int = 1) -> Iterator[slice]:
    """The rows of an array, some at a time; each strip but the last has a ``multiple`` of rows."""
    rows = max(multiple, _CELLS // max(shape[1], 1) // multiple * multiple)
    for first in range(0, shape[0], rows):
        yield slice(first, min(first + rows, shape[0]))


def patch_sizes(labels: NDArray[Any], count: int) -> NDArray[np.int64]:
    """(count + 1,) how many cells have each label of 0 to ``count``."""
    sizes = np.zeros(count + 1, dtype=np.int64)
    for rows in strips(labels.shape):
        sizes += np.bincount(labels[rows].ravel(), minlength=count + 1)
    return sizes


def spread(values: NDArray[_Value], labels: NDArray[Any]) -> NDArray[_Value]:
    """(rows, columns) for each cell the value (count + 1,) of its label."""
    spread_out = np.empty(labels.shape, dtype=values.dtype)
    for rows in strips(labels.shape):
        spread_out[rows] = values[labels[rows]]
    return spread_out
