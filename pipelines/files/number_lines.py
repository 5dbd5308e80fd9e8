"""Lines of numbers, time first: the common form of trajectory and relation files."""

from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

from racecar.maps.errors import UserError
from racecar.maps.text_files import read_text

_LATEST_SECONDS = 2**63 // 10**9
"""Because stamps are 64-bit nanoseconds."""
_LARGEST = 1e9
"""Metres; twenty times round the earth, and squares and sums of so much are still exact enough."""


@dataclass(frozen=True)
class NumberLine:
    """One line, and where it stands."""

    place: str
    """For messages: line and file."""
    stamps: list[int]
    """The leading times, in nanoseconds."""
    numbers: list[float]
    """The rest."""


def read_number_lines(path: Path, layout: str, *, stamps: int) -> Iterator[NumberLine]:
    """The lines of a text file, but for empty ones and comments (#).

    `layout` names the columns, the first `stamps` of them are seconds. Raises UserError that names the line
    when it does not hold as many finite numbers, none of them absurdly large.
    """
    columns = len(layout.split())
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        fields = line.split()
        if not fields or fields[0].startswith("#"):
            continue
        place = f"line {number} of {path}"
        if len(fields) != columns:
            raise UserError(f"There are {len(fields)} values in {place}; it should hold '{layout}'.")
        try:
            yield NumberLine(
                place,
                [_nanoseconds(field) for field in fields[:stamps]],
                [_usable(field) for field in fields[stamps:]],
            )
        except (ArithmeticError, ValueError) as error:
            raise UserError(
                f"Not every value is a usable number in {place}; it should hold '{layout}'."
            ) from error


def _nanoseconds(field: str) -> int:
    seconds = Decimal(field)
    if not abs(seconds) < _LATEST_SECONDS:
        raise ValueError(field)
    return int((seconds * 10**9).to_integral_value())


def _usable(field: str) -> float:
    number = float(field)
    if not abs(number) <= _LARGEST:
        raise ValueError(field)
    return number
