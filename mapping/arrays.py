"""State as named arrays: what a mapper is made of, without a word about files."""

from collections.abc import Mapping, Sequence
from typing import TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose

Arrays: TypeAlias = dict[str, NDArray[np.generic]]
"""Arrays by name; names of parts are joined by a dot."""

Number = TypeVar("Number", bound=np.generic)


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


def pose_or_none(array: NDArray[np.generic]) -> Pose | None:
    """The pose (3,), None where it is NaN."""
    pose = array.astype(np.float64)
    return None if np.isnan(pose).any() else pose
