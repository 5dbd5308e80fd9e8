"""Lines of numbers, time first: the common form of trajectory and relation files."""

from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

from racecar.maps.errors import UserError
from racecar.maps.text_files import read_text
from racecar.maps.whole_folders import finish_replacing

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
    finish_replacing(path)
    columns = len(layout.split())
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        fields = line.split()
        if not fields or fields[0].startswith("#"):
            continue
        place = f"line {number} of {path}"
        if len(fields) != columns:
            raise UserError(
                f"In {place} should be '{layout}', {columns} values, and there are {len(fields)}."
            )
        try:
            yield NumberLine(
                place,
                [nanoseconds_of(field) for field in fields[:stamps]],
                [usable_number(field) for field in fields[stamps:]],
            )
        except (ArithmeticError, ValueError) as error:
            raise UserError(
                f"Not every value is a usable number in {place}; it should hold '{layout}'."
            ) from error


def nanoseconds_of(field: str, unit: int = 10**9) -> int:
    """A time written in units of so many nanoseconds, to the nanosecond. Raises what Decimal does, or
    ValueError when it does not fit into 64 bits."""
    stamp = Decimal(field) * unit
    if not abs(stamp) < _LATEST_SECONDS * 10**9:
        raise ValueError(field)
    return int(stamp.to_integral_value())


def usable_number(field: str) -> float:
    """A finite number that is not absurdly large. Raises ValueError."""
    number = float(field)
    if not abs(number) <= _LARGEST:
        raise ValueError(field)
    return number
