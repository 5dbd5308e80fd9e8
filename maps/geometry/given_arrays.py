"""Arrays and poses that a caller gave: their shapes, numbers and units."""

import math
import reprlib
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose

_MOST_TURN = math.tau + 0.02
"""Radians, slightly more than a full turn; larger values were meant as degrees."""
BEYOND_ANY_MAP = 1e9
"""Metres: an error, since no map is a million kilometres wide."""


def as_array(
    value: ArrayLike, what: str, shape: tuple[int | None, ...], dtype: type[np.generic] = np.float64
) -> NDArray[Any]:
    """An array of a shape, in which None is any size; the same one if it is of its type already.

    Raises UserError that names ``what`` it is when it has another shape, or does not hold such numbers.
    """
    array = value
    if not isinstance(array, np.ndarray) or array.dtype.type is not dtype:
        try:
            array = np.asarray(value).astype(dtype, casting="same_kind")
        except (TypeError, ValueError) as error:
            holds = "whole numbers" if np.issubdtype(dtype, np.integer) else "numbers"
            given = " ".join(reprlib.repr(value).split())
            raise UserError(f"{what} should be {_form(shape)} of {holds}, not {given}.") from error
    if array.shape != shape and not _fits(array.shape, shape):
        raise UserError(f"{what} should be {_form(shape)}, not one of shape {array.shape}.")
    return array


def as_pose(value: ArrayLike, what: str) -> Pose:
    """A pose (3,). Raises UserError when it is not three finite numbers, or its yaw is in degrees."""
    try:
        pose = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        pose = np.empty(0)
    numbers = pose.tolist()  # plain floats take a tenth of the time
    if pose.shape != (3,) or not all(map(_is_on_a_map, numbers)):
        raise UserError(f"{what} is not three finite numbers; give x and y in metres and yaw in radians.")
    if (slip := angle_slip("yaw", numbers[2])) is not None:
        raise UserError(f"{what} cannot be used: {slip}.")
    return pose


def _is_on_a_map(number: float) -> bool:
    return abs(number) < BEYOND_ANY_MAP


def _fits(shape: tuple[int, ...], wanted: tuple[int | None, ...]) -> bool:
    return len(shape) == len(wanted) and all(
        size in (None, given) for given, size in zip(shape, wanted, strict=True)
    )


def angle_slip(name: str, angle: float) -> str | None:
    """What is wrong with an angle that was given, as the end of a sentence; None if nothing is."""
    if abs(angle) <= _MOST_TURN:
        return None
    if not math.isfinite(angle):
        return f"a {name} of {angle:g} is no angle: give radians"
    return (
        f"a {name} of {angle:g} goes round more than once: give radians, {math.radians(angle):.4f} if "
        "these are degrees"
    )


def _form(shape: tuple[int | None, ...]) -> str:
    sizes = ", ".join("N" if size is None else str(size) for size in shape)
    return f"an array ({sizes}{',' if len(shape) == 1 else ''})"
