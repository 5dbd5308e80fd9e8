"""The state of a mapper as named arrays, independent of files."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose

Arrays: TypeAlias = dict[str, NDArray[np.generic]]
"""Arrays by name; names of parts are joined by a dot."""

Number = TypeVar("Number", bound=np.generic)


class ArrayLayout(NamedTuple):
    """Expected type and shape of an array."""

    kinds: str
    """Allowed dtype kinds as NumPy's letters: f float, i and u integers, b bool, U text."""
    shape: tuple[str | int, ...]
    """Expected sizes; a named size must be the same wherever it appears."""


def check_layout(arrays: Mapping[str, NDArray[np.generic]], layouts: Mapping[str, ArrayLayout]) -> None:
    """Raise ValueError naming the array that is missing or has the wrong type or shape."""
    sizes: dict[str, int] = {}
    for name, layout in layouts.items():
        if name not in arrays:
            raise ValueError(f"{name} is missing")
        array = arrays[name]
        if array.dtype.kind not in layout.kinds or array.ndim != len(layout.shape):
            raise ValueError(f"{name} is not of its type or shape")
        for size, known in zip(array.shape, layout.shape, strict=True):
            expected = sizes.setdefault(known, size) if isinstance(known, str) else known
            if size != expected:
                raise ValueError(f"{name} is not of its shape")


def named(part: str, arrays: Mapping[str, NDArray[np.generic]]) -> Arrays:
    """Prefix the names of arrays with the name of their part."""
    return {f"{part}.{name}": array for name, array in arrays.items()}


def part_of(part: str, arrays: Mapping[str, NDArray[np.generic]]) -> Arrays:
    """The arrays of one part, with the prefix removed from their names."""
    prefix = f"{part}."
    return {name[len(prefix) :]: array for name, array in arrays.items() if name.startswith(prefix)}


def pack(
    rows: Sequence[NDArray[Number]], empty: NDArray[Number]
) -> tuple[NDArray[Number], NDArray[np.int64]]:
    """Concatenated rows (N_k, ...) and their lengths (K,); ``empty`` (0, ...) has their dtype and shape."""
    lengths = np.array([len(row) for row in rows], dtype=np.int64)
    return np.concatenate([empty, *rows]), lengths


def unpack(packed: NDArray[Number], lengths: NDArray[np.generic]) -> list[NDArray[Number]]:
    """Split packed rows again; each array gets its own memory."""
    ends = np.cumsum(lengths.astype(np.int64))
    return [packed[end - n : end].copy() for n, end in zip(lengths.tolist(), ends.tolist(), strict=True)]


def side_by_side(rows: Sequence[NDArray[Number]]) -> list[NDArray[Number]]:
    """The same rows (N_k, ...) as views of one block of memory.

    Thousands of long-lived blocks of a few kilobytes fragment the heap and keep its pages from being returned
    to the system.
    """
    if not rows:
        return []
    return np.split(np.concatenate(rows), np.cumsum([len(row) for row in rows])[:-1])


def pose_or_nan(pose: Pose | None) -> Pose:
    """(3,) the pose, or NaN for None."""
    return np.full(3, np.nan) if pose is None else np.asarray(pose, dtype=np.float64)
