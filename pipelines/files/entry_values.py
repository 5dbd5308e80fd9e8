"""Values of entries in ``edits.yaml``, checked."""

from difflib import get_close_matches
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from racecar.maps.errors import UserError

_FARTHEST = 1e7
"""Metres; a quarter of the earth's circumference."""


def check_keys(entry: dict[Any, Any], allowed: list[str], known: str, where: str) -> None:
    """Raises UserError naming a key that is not ``allowed``; ``known`` says which there are."""
    for key in entry:
        if key not in allowed:
            near = get_close_matches(str(key), allowed, n=1)
            remedy = f"did you mean '{near[0]}'" if near else f"known are {known}"
            raise UserError(f"{where} has the unknown key '{str(key)[:40]}'; {remedy}.")


def points_of(value: Any, kind: str, where: str) -> NDArray[np.float64]:
    """(N, 2) metres. Raises UserError unless the value is a list of points."""
    if not isinstance(value, list) or not all(is_numbers(point, 2) for point in value):
        raise UserError(
            f"{where}: {kind} should be a list of points in metres, such as [[0, 0], [5, 0], [5, 2]]."
        )
    return np.array(value, dtype=np.float64).reshape(-1, 2)


def is_numbers(value: Any, *counts: int) -> bool:
    """Whether a value is a list of plausible numbers, of one of these lengths."""
    return isinstance(value, list) and len(value) in counts and all(is_number(x) for x in value)


def is_number(value: Any) -> bool:
    """Whether a value is a number that can be metres or seconds."""
    return _is_real(value) and abs(value) <= _FARTHEST


def number_of(
    entry: dict[Any, Any],
    key: str,
    low: float,
    high: float,
    unit: str,
    where: str,
    default: float | None = None,
) -> float:
    """The number of a key, above ``low``. Raises UserError when it is missing without a default, or is
    beyond."""
    if key not in entry and default is not None:
        return default
    value = entry.get(key)
    if not (_is_real(value) and low < value <= high):
        told = "is missing" if value is None else f"is {str(value)[:40]}"
        raise UserError(f"{where}: {key} {told}; it should be {unit}, above {low:g} and at most {high:g}.")
    return float(value)


def _is_real(value: Any) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool)
