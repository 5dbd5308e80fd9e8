"""State as named arrays: what a mapper is made of, without a word about files."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose

Arrays: TypeAlias = dict[str, NDArray[np.generic]]
"""Arrays by name; names of parts are joined by a dot."""

Number = TypeVar("Number", bound=np.generic)


class ArrayLayout(NamedTuple):
    """What an array is like."""

    kinds: str
    """NumPy's letters of the types it may have: f float, i and u integers, b bool, U text."""
    shape: tuple[str | int, ...]
    """Its sizes; those with a name are the same wherever it stands."""


def check_layout(arrays: Mapping[str, NDArray[np.generic]], layouts: Mapping[str, ArrayLayout]) -> None:
    """Raises ValueError that names the array that is missing, or not of its type or shape."""
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
    """The arrays of a part, under names that tell the part."""
    return {f"{part}.{name}": array for name, array in arrays.items()}


def part_of(part: str, arrays: Mapping[str, NDArray[np.generic]]) -> Arrays:
    """The arrays of one part, under its own names for them."""
    prefix = f"{part}."
    return {name[len(prefix) :]: array for name, array in arrays.items() if name.startswith(prefix)}


def pack(
    rows: Sequence[NDArray[Number]], empty: NDArray[Number]
) -> tuple[NDArray[Number], NDArray[np.int64]]:
    """Rows (N_k, ...) as one (sum of N_k, ...) and their lengths (K,); ``empty`` (0, ...) says the type."""
    lengths = np.array([len(row) for row in rows], dtype=np.int64)
    return np.concatenate([empty, *rows]), lengths


def unpack(packed: NDArray[Number], lengths: NDArray[np.generic]) -> list[NDArray[Number]]:
    """The arrays that were packed, each with memory of its own."""
    ends = np.cumsum(lengths.astype(np.int64))
    return [packed[end - n : end].copy() for n, end in zip(lengths.tolist(), ends.tolist(), strict=True)]


def side_by_side(rows: Sequence[NDArray[Number]]) -> list[NDArray[Number]]:
    """The same rows (N_k, ...) as parts of one block of memory.

    Thousands of blocks that stay, each of a few kilobytes, lie among what comes and goes, and hold its pages
    back from the machine.
    """
    if not rows:
        return []
    return np.split(np.concatenate(rows), np.cumsum([len(row) for row in rows])[:-1])


def pose_or_nan(pose: Pose | None) -> Pose:
    """(3,) a pose, NaN where there is none."""
    return np.full(3, np.nan) if pose is None else np.asarray(pose, dtype=np.float64)
