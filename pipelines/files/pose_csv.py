"""Trajectories as CSV with column names in the first line: those of EuRoC, ``rostopic echo -p`` and
PlotJuggler, or simply ``t,x,y,yaw``."""

import csv
import math
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from racecar.maps.errors import UserError
from racecar.maps.text_files import read_text
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.files.table import Column, Row, StampedPose, trajectory_of

_LAYOUT = "t,x,y,yaw or t,x,y,qx,qy,qz,qw"
_TIME = r"(?:.*_)?(?:t|time|timestamp|stamp)(?:_(?P<unit>ns|us|ms|s|sec))?"
_SECONDS, _NANOSECONDS = r".*stamp_secs?", r".*stamp_n(?:ano)?secs?"
"""The two columns into which some exporters split a message's stamp."""
_POSITION = r"(?:|p_(?:.*_)?|(?:.*_)?(?:position|pos|pose|translation)_){axis}(?:_m)?"
_ROTATION = r"(?:q_?(?:.*_)?|(?:.*_)?(?:orientation|rotation|quaternion|quat)_){axis}"
_YAW = r"(?:.*_)?(?:yaw|theta)(?:_(?P<unit>rad|deg))?"
_NANOSECONDS_IN = {"ns": 1, "us": 10**3, "ms": 10**6, "s": 10**9, "sec": 10**9}
_TIMES_SINCE_1970 = ((1e11, 10**9), (1e14, 10**6), (1e17, 10**3), (math.inf, 1))
"""Upper limit of a time without a unit, and the nanoseconds of the unit it then has: 1.7e9 s have passed
since 1970."""


def load_pose_csv(path: Path) -> Trajectory:
    """Read poses from a CSV file; of 3D poses, only x, y and yaw are used.

    Raises UserError that names the missing or ambiguous column, or the line at fault.
    """
    names, *rows = _lines(path)
    header = _Header(path, names.values)
    time = header.time(rows[0] if rows else None)
    x, y = (header.one(_POSITION.format(axis=axis), axis) for axis in "xy")
    rotation = [header.find(_ROTATION.format(axis=axis), f"q{axis}") for axis in "xyzw"]
    quaternion = [column for column in rotation if column is not None]
    yaw = None if len(quaternion) == len(rotation) else header.one(_YAW, "yaw")
    poses = (
        StampedPose(
            row,
            row.stamp(*time),
            row.number(x),
            row.number(y),
            row.yaw(quaternion) if yaw is None else _in_radians(row, yaw, header.unit(_YAW, yaw)),
        )
        for row in rows
    )
    return trajectory_of(poses, path, _LAYOUT)


def _in_radians(row: Row, yaw: Column, unit: str | None) -> float:
    value = row.number(yaw)
    if unit is None and abs(value) > 2 * math.pi:
        raise UserError(
            f"The {yaw.name} in {row.place} is {value:g}, more than a full turn: name the column yaw_deg "
            "if it is in degrees, or yaw_rad if it is in radians and counts the turns."
        )
    return math.radians(value) if unit == "deg" else value


class _Header:
    """Finds columns by name."""

    def __init__(self, path: Path, names: Sequence[str]) -> None:
        self._path = path
        self._columns = [Column(index, name.strip(" #%")) for index, name in enumerate(names)]

    def one(self, pattern: str, meant: str) -> Column:
        """The column that matches. Raises UserError when there is none, or several."""
        column = self.find(pattern, meant)
        if column is None:
            raise self._missing(meant)
        return column

    def find(self, pattern: str, meant: str) -> Column | None:
        """The column that matches, or None. Raises UserError when there are several."""
        found = self._all(pattern)
        if len(found) > 1:
            names = ", ".join(column.name for column in found)
            raise UserError(f"Several columns of {self._path} could be {meant}: {names}; keep one of them.")
        return found[0] if found else None

    def time(self, first: Row | None) -> list[Column]:
        """The time column, or those of its seconds and nanoseconds. The message's stamp is preferred to its
        recording time. Raises UserError when there is none."""
        seconds, nanoseconds = self._all(_SECONDS), self._all(_NANOSECONDS)
        if seconds and nanoseconds:
            return [seconds[0], replace(nanoseconds[0], nanoseconds=1)]
        found = sorted(self._all(_TIME), key=lambda column: "stamp" not in column.name.lower())
        if not found:
            raise self._missing("t")
        time, unit = found[0], self.unit(_TIME, found[0])
        if unit is not None:
            return [replace(time, nanoseconds=_NANOSECONDS_IN[unit])]
        count = 0 if first is None else abs(first.stamp(replace(time, nanoseconds=1)))
        return [replace(time, nanoseconds=next(each for most, each in _TIMES_SINCE_1970 if count < most))]

    def unit(self, pattern: str, column: Column) -> str | None:
        """The unit in the name of a column that matches."""
        match = _match(pattern, column)
        return None if match is None else match["unit"]

    def _all(self, pattern: str) -> list[Column]:
        return [column for column in self._columns if _match(pattern, column) is not None]

    def _missing(self, meant: str) -> UserError:
        names = ", ".join(column.name for column in self._columns)
        return UserError(
            f"No column of {self._path} is {meant}; its first line should name the columns {_LAYOUT}, "
            f"and names {names}."
        )


def _match(pattern: str, column: Column) -> re.Match[str] | None:
    return re.fullmatch(pattern, re.sub(r"[^a-z0-9]+", "_", column.name.lower()).strip("_"))


def _lines(path: Path) -> list[Row]:
    """Lines with values, after the column names. Raises UserError when one has too few values."""
    text = read_text(path)
    delimiter = max(",;\t", key=text.partition("\n")[0].count)
    rows = [
        Row(f"line {number} of {path}", [value.strip() for value in values])
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
