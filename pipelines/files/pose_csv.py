"""Trajectories as CSV, whose first line names the columns: as EuRoC, ``rostopic echo -p`` and PlotJuggler
name them, or simply ``t,x,y,yaw``."""

import csv
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from racecar.maps.errors import UserError
from racecar.maps.text_files import read_text
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.files.number_lines import nanoseconds_of, usable_number
from racecar.pipelines.files.pose_rows import PoseRows

_LAYOUT = "t,x,y,yaw or t,x,y,qx,qy,qz,qw"
_TIME = r"(?:.*_)?(?:t|time|timestamp|stamp)(?:_(?P<unit>ns|us|ms|s|sec))?"
_SECONDS, _NANOSECONDS = r".*stamp_secs?", r".*stamp_n(?:ano)?secs?"
"""The two columns into which some exporters take a message's stamp apart."""
_POSITION = r"(?:|p_(?:.*_)?|(?:.*_)?(?:position|pos|pose|translation)_){axis}(?:_m)?"
_ROTATION = r"(?:q_?(?:.*_)?|(?:.*_)?(?:orientation|rotation|quaternion|quat)_){axis}"
_YAW = r"(?:.*_)?(?:yaw|theta)(?:_(?P<unit>rad|deg))?"
_NANOSECONDS_IN = {"ns": 1, "us": 10**3, "ms": 10**6, "s": 10**9, "sec": 10**9}
_TIMES_SINCE_1970 = ((1e11, "s"), (1e14, "ms"), (1e17, "us"), (math.inf, "ns"))
"""Up to which number a time without a unit is in seconds and so on: some 1.7e9 s have passed since 1970."""


@dataclass(frozen=True)
class _Column:
    index: int
    name: str
    """As it stands in the file."""
    unit: str | None = None


@dataclass(frozen=True)
class _Row:
    place: str
    """For messages: line and file."""
    values: list[str]

    def number(self, column: _Column) -> float:
        """Raises UserError when it is none that can be used."""
        try:
            return usable_number(self.values[column.index])
        except ValueError as error:
            raise self._unusable(column) from error

    def stamp(self, time: Sequence[_Column]) -> int:
        """Nanoseconds, the sum of the columns. Raises UserError when it is not a time."""
        stamp = 0
        for column in time:
            try:
                stamp += nanoseconds_of(self.values[column.index], _NANOSECONDS_IN[column.unit or "s"])
            except (ArithmeticError, ValueError) as error:
                raise self._unusable(column) from error
        return stamp

    def _unusable(self, column: _Column) -> UserError:
        value = self.values[column.index] or "nothing"
        return UserError(f"The {column.name} in {self.place} is {value}, which is not a usable number.")


def load_pose_csv(path: Path) -> Trajectory:
    """Read the poses of a CSV file; of poses in space, x, y and the yaw are taken.

    Raises UserError that names the column that is missing or ambiguous, or the line at fault.
    """
    names, *rows = _lines(path)
    header = _Header(path, names.values)
    time = header.time(rows[0] if rows else None)
    x, y = (header.one(_POSITION.format(axis=axis), axis) for axis in "xy")
    rotation = [header.find(_ROTATION.format(axis=axis), f"q{axis}") for axis in "xyzw"]
    quaternion = [column for column in rotation if column is not None]
    yaw = None if len(quaternion) == len(rotation) else header.one(_YAW, "yaw")
    poses = PoseRows(_LAYOUT)
    for row in rows:
        turned = (
            poses.yaw_of(row.place, [row.number(column) for column in quaternion])
            if yaw is None
            else _in_radians(row, yaw)
        )
        poses.add(row.place, row.stamp(time), row.number(x), row.number(y), turned)
    return poses.trajectory(path)


def _in_radians(row: _Row, yaw: _Column) -> float:
    value = row.number(yaw)
    if yaw.unit is None and abs(value) > 2 * math.pi:
        raise UserError(
            f"The {yaw.name} in {row.place} is {value:g}, more than a full turn: name the column yaw_deg "
            "if it is in degrees, or yaw_rad if it is in radians and counts the turns."
        )
    return math.radians(value) if yaw.unit == "deg" else value


class _Header:
    """Finds columns by what they are called."""

    def __init__(self, path: Path, names: Sequence[str]) -> None:
        self._path = path
        self._columns = [_Column(index, name.strip(" #%")) for index, name in enumerate(names)]

    def one(self, pattern: str, meant: str) -> _Column:
        """The column that matches. Raises UserError when there is none, or several."""
        column = self.find(pattern, meant)
        if column is None:
            raise self._missing(meant)
        return column

    def find(self, pattern: str, meant: str) -> _Column | None:
        """The same, or None. Raises UserError when there are several."""
        found = self._all(pattern)
        if len(found) > 1:
            names = ", ".join(column.name for column in found)
            raise UserError(f"Several columns of {self._path} could be {meant}: {names}; keep one of them.")
        return found[0] if found else None

    def time(self, first: _Row | None) -> list[_Column]:
        """The column of time, or those of its seconds and nanoseconds; the stamp of the message comes before
        the time at which it was recorded. Raises UserError when there is none."""
        seconds, nanoseconds = self._all(_SECONDS), self._all(_NANOSECONDS)
        if seconds and nanoseconds:
            return [replace(seconds[0], unit="s"), replace(nanoseconds[0], unit="ns")]
        found = sorted(self._all(_TIME), key=lambda column: "stamp" not in column.name.lower())
        if not found:
            raise self._missing("t")
        if found[0].unit is None and first is not None:
            count = abs(first.stamp([replace(found[0], unit="ns")]))
            return [replace(found[0], unit=next(unit for most, unit in _TIMES_SINCE_1970 if count < most))]
        return found[:1]

    def _all(self, pattern: str) -> list[_Column]:
        found = []
        for column in self._columns:
            match = re.fullmatch(pattern, re.sub(r"[^a-z0-9]+", "_", column.name.lower()).strip("_"))
            if match is not None:
                found.append(replace(column, unit=match.groupdict().get("unit")))
        return found

    def _missing(self, meant: str) -> UserError:
        names = ", ".join(column.name for column in self._columns)
        return UserError(
            f"No column of {self._path} is {meant}; its first line should name the columns {_LAYOUT}, "
            f"and names {names}."
        )


def _lines(path: Path) -> list[_Row]:
    """The lines with values, the names of the columns first. Raises UserError when one has too few."""
    text = read_text(path)
    delimiter = max(",;\t", key=text.partition("\n")[0].count)
    rows = [
        _Row(f"line {number} of {path}", [value.strip() for value in values])
        for number, values in enumerate(csv.reader(text.splitlines(), delimiter=delimiter), start=1)
        if any(value.strip() for value in values)
    ]
    if not rows:
        raise UserError(f"{path} is empty; its first line should name the columns {_LAYOUT}.")
    for row in rows:
        if len(row.values) != len(rows[0].values):
            raise UserError(
                f"There are {len(row.values)} values in {row.place}, and {len(rows[0].values)} columns; "
                "write one value for each."
            )
    return rows
