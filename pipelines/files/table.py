"""Tables of numbers in text files, such as trajectories: rows with a value in each named column."""

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
"""Largest time in seconds, because stamps are 64-bit nanoseconds."""
_LARGEST = 1e9
"""Metres; twenty times around the earth, and squares and sums of such numbers are still exact enough."""
_LONGEST_VALUE = 40
"""Characters of a value in a message; no number has more."""
_SHORTEST, _LONGEST = 0.5, 2.0
"""Length of a quaternion that is meant as a rotation, which is 1 apart from rounding. Chosen by judgement, to
notice columns in another order."""


@dataclass(frozen=True)
class Column:
    """Position of a value in its row, and its name there."""

    index: int
    name: str
    nanoseconds: int = 10**9
    """Nanoseconds per unit, for a time."""


@dataclass(frozen=True)
class Row:
    """Values of a line. Its methods raise UserError that names the line and column at fault."""

    place: str
    """Line and file, for messages."""
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
        """Sum of the columns in nanoseconds, exact to the nanosecond."""
        return sum(self._stamp(column) for column in columns)

    def yaw(self, quaternion: Sequence[Column]) -> float:
        """Radians, from a quaternion x, y, z, w."""
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
    """A pose from a row."""

    row: Row
    stamp: int
    """Nanoseconds."""
    x: float
    y: float
    yaw: float


def columns_of(layout: str) -> list[Column]:
    """Columns named by a layout such as "t x y"."""
    return [Column(index, name) for index, name in enumerate(layout.split())]


def read_rows(path: Path, layout: str) -> Iterator[Row]:
    """Rows of a text file without a header, with values separated by spaces. Empty lines and comments (#) are
    skipped. Raises UserError that names the line with more or fewer values than the layout."""
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
    names the line with a time not after the previous one."""
    rows = list(poses)
    if not rows:
        raise UserError(f"{path} holds no poses; it should hold lines '{layout}'.")
    stamps = np.array([pose.stamp for pose in rows], dtype=np.int64)
    backwards = np.flatnonzero(np.diff(stamps) <= 0)
    if len(backwards):
        place = rows[backwards[0] + 1].row.place
        raise UserError(f"The time in {place} is not after the one before; sort the file by time.")
    return Trajectory(stamps, np.array([pose[2:] for pose in rows]))
