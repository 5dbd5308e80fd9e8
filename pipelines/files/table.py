"""Tables of numbers in text files, such as trajectories: rows of values, one of a name in each column."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import NamedTuple

import numpy as np

from racecar.maps.errors import UserError
from racecar.maps.text_files import read_text
from racecar.maps.trajectory import Trajectory
from racecar.maps.whole_folders import finish_replacing

_LATEST_SECONDS = 2**63 // 10**9
"""Because stamps are 64-bit nanoseconds."""
_LARGEST = 1e9
"""Metres; twenty times round the earth, and squares and sums of so much are still exact enough."""
_LONGEST_VALUE = 40
"""Characters of it in a message, since no number has more."""
_SHORTEST, _LONGEST = 0.5, 2.0
"""Of a quaternion that is meant as a rotation, whose length is 1 but for rounding; by judgement, so that
columns in another order are noticed."""


@dataclass(frozen=True)
class Column:
    """Where a value stands in its row, and what it is called there."""

    index: int
    name: str
    nanoseconds: int = 10**9
    """Those of its unit, if it is a time."""


@dataclass(frozen=True)
class Row:
    """The values of a line. Its methods raise UserError that names line and column at fault."""

    place: str
    """For messages: line and file."""
    values: Sequence[str]

    def number(self, column: Column) -> float:
        """A finite number that is not absurdly large."""
        try:
            number = float(self.values[column.index])
        except ValueError as error:
            raise self._unusable(column) from error
        if not abs(number) <= _LARGEST:
            raise self._unusable(column)
        return number

    def stamp(self, *columns: Column) -> int:
        """Nanoseconds, to the nanosecond: the sum of the columns."""
        return sum(self._stamp(column) for column in columns)

    def yaw(self, quaternion: Sequence[Column]) -> float:
        """Radians, of a quaternion x, y, z, w."""
        qx, qy, qz, qw = numbers = [self.number(column) for column in quaternion]
        length = math.hypot(*numbers)
        if not _SHORTEST <= length <= _LONGEST:
            raise UserError(
                f"The quaternion in {self.place} is {length:.3g} long instead of 1, so it is not a rotation; "
                f"the columns {', '.join(column.name for column in quaternion)} should hold it."
            )
        return math.atan2(2 * (qw * qz + qx * qy), qw**2 + qx**2 - qy**2 - qz**2)

    def _stamp(self, column: Column) -> int:
        try:
            stamp = Decimal(self.values[column.index]) * column.nanoseconds
            if abs(stamp) < _LATEST_SECONDS * 10**9:
                return int(stamp.to_integral_value())
        except (ArithmeticError, ValueError) as error:
            raise self._unusable(column) from error
        raise self._unusable(column)

    def _unusable(self, column: Column) -> UserError:
        value = self.values[column.index][:_LONGEST_VALUE] or "nothing"
        return UserError(f"The {column.name} in {self.place} is {value}, which is not a usable number.")


class StampedPose(NamedTuple):
    """A pose as a row holds it."""

    row: Row
    stamp: int
    """Nanoseconds."""
    x: float
    y: float
    yaw: float


def columns_of(layout: str) -> list[Column]:
    """The columns that a layout names, as in "t x y"."""
    return [Column(index, name) for index, name in enumerate(layout.split())]


def read_rows(path: Path, layout: str) -> Iterator[Row]:
    """The rows of a text file without a header, whose values are apart by spaces; not empty lines, nor
    comments (#). Raises UserError that names the line which holds more or fewer values than the layout."""
    finish_replacing(path)
    columns = len(layout.split())
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        values = line.split()
        if not values or values[0].startswith("#"):
            continue
        place = f"line {number} of {path}"
        if len(values) != columns:
            raise UserError(
                f"In {place} should be '{layout}', {columns} values, and there are {len(values)}."
            )
        yield Row(place, values)


def trajectory_of(poses: Iterable[StampedPose], path: Path, layout: str) -> Trajectory:
    """The poses of a file whose rows should have a layout. Raises UserError when there are none, or that
    names the line which is not after the one before."""
    rows = list(poses)
    if not rows:
        raise UserError(f"{path} holds no poses; it should hold lines '{layout}'.")
    stamps = np.array([pose.stamp for pose in rows], dtype=np.int64)
    backwards = np.flatnonzero(np.diff(stamps) <= 0)
    if len(backwards):
        place = rows[backwards[0] + 1].row.place
        raise UserError(f"The time in {place} is not after the one before; sort the file by time.")
    return Trajectory(stamps, np.array([pose[2:] for pose in rows]))
