"""The log of a live drive: the mapper's inputs, from which another node rebuilds the map if one was killed.

The file begins with a line that names its format, followed by records. If it is truncated, the records before
that are read, and later ones are written in place of the rest.
"""

import struct
import time
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from os.path import realpath
from pathlib import Path
from typing import BinaryIO, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from racecar.pipelines.live.intake.laser_place import LaserPlace
from racecar.sensors.cloud import Cloud
from racecar.sensors.measurement import Measurement
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.yaw_rate import YawRate

_RESUMED_WITHIN = 3600.0
"""Seconds after which a log belongs to an earlier drive."""
_PLACE = TypeAdapter(LaserPlace)
_FORMAT = b"racecar drive log 1\n"
_HEAD = struct.Struct("<cII")
"""Head of a record: its kind, the bytes that follow, and their checksum, seeded with the kind."""
_LONGEST = 1 << 26
"""Bytes of a record. Chosen by judgement: four times those of a million points."""
_ODOMETRY = struct.Struct("<q6d")
_YAW_RATE = struct.Struct("<qd")
_BEAMS = struct.Struct("<BI")
"""A laser and its number of beams; their bearings and times follow."""
_SCAN = struct.Struct("<qB4dci")
"""Stamp, laser, its place (3), maximum range, the type of the ranges, and the number of points of a cloud, -1
without one; ranges, points and the times of the points follow."""


@dataclass(frozen=True)
class AnotherDrive:
    """Marks the start of a separate drive, since the car's motion in between is unknown."""


Entry: TypeAlias = Measurement | LaserPlace | AnotherDrive


class DriveLog:
    """Measurements in the order of the mapper's input, and the place of the first laser."""

    def __init__(self, out: Path) -> None:
        """The log lies beside the output folder ``out``."""
        folder = Path(realpath(out))
        self.path = folder.parent / f"{folder.name}.drive.log"
        self.broken_off: float | None = None
        """Seconds since the drive that is to be continued was interrupted; None if there is none."""
        self.is_unread = False
        """Whether `entries` holds some of that drive that have not been taken yet."""
        self._end = 0
        """Where the next record is written; the file is intact up to there."""
        self._file: BinaryIO | None = None
        self._beams: dict[int, bytes] = {}
        self._place = b""

    @property
    def is_recent(self) -> bool:
        """Whether there is a log of a drive that a node could go on with."""
        return self.path.is_file() and self._age < _RESUMED_WITHIN

    @property
    def _age(self) -> float:
        """Seconds since the last entry."""
        return time.time() - self.path.stat().st_mtime

    def go_on(self, announce: Callable[[str], None]) -> None:
        """Continue the drive of a node killed not long ago, if there is one, and announce it. Otherwise new
        entries replace the contents of the file."""
        if not self.path.is_file():
            return
        seconds = self._age
        if seconds > _RESUMED_WITHIN:
            announce(f"{self.path} is of an earlier drive and is not used.")
        elif not self._holds_something():
            announce(f"{self.path} is empty or damaged, and the drive begins from scratch.")
        else:
            self.broken_off, self.is_unread = seconds, True
            announce(f"The node was killed: the drive goes on from {self.path}, by which it is mapped again.")

    def entries(self) -> Iterator[Entry]:
        """The logged entries, as far as the file is intact; new ones will follow the last one read."""
        beams: dict[int, list[NDArray[np.float64]]] = {}
        with self.path.open("rb") as file:
            record = (b"", b"") if file.read(len(_FORMAT)) == _FORMAT else None
            while record is not None:
                self._end = file.tell()
                record = _next_record(file)
                try:
                    entry = None if record is None else _read(*record, beams)
                except (struct.error, ValueError, LookupError, TypeError):  # written by another version
                    entry = record = None
                if entry is not None:
                    yield entry
        self.is_unread = False

    def add(self, entry: Entry) -> None:
        """Write an entry so that it outlives this process. Raises OSError; the file does not contain it
        then."""
        if isinstance(entry, Scan):
            beams = _BEAMS.pack(entry.laser, len(entry.bearings))
            beams += entry.bearings.tobytes() + entry.time_offsets.tobytes()
            if self._beams.get(entry.laser) != beams:
                self._write(b"B", beams)
                self._beams[entry.laser] = beams
            self._write(b"S", _scan_bytes(entry))
        elif isinstance(entry, Odometry):
            self._write(b"O", _ODOMETRY.pack(entry.stamp, *entry.odom_from_base, *entry.twist))
        elif isinstance(entry, YawRate):
            self._write(b"Y", _YAW_RATE.pack(entry.stamp, entry.rate))
        elif isinstance(entry, LaserPlace):
            place = _PLACE.dump_json(entry)
            if place != self._place:
                self._write(b"P", place)
                self._place = place
        else:
            self._write(b"A", b"")

    def remove(self) -> None:
        """Remove the log of a drive whose map is saved."""
        if self._file is not None:
            self._file.close()
        self.path.unlink(missing_ok=True)

    def _holds_something(self) -> bool:
        try:
            return next(self.entries(), None) is not None
        except OSError:
            return False

    def _write(self, kind: bytes, content: bytes) -> None:
        if self._file is None:
            self._file = self.path.open("r+b" if self._end else "wb", buffering=0)
        record = _HEAD.pack(kind, len(content), zlib.crc32(content, kind[0])) + content
        if not self._end:
            record = _FORMAT + record
        self._file.seek(self._end)
        self._file.truncate()
        if self._file.write(record) < len(record):
            raise OSError(f"{self.path} cannot grow")
        self._end += len(record)


def _next_record(file: BinaryIO) -> tuple[bytes, bytes] | None:
    """Its kind and content; None where the file ends or is damaged."""
    head = file.read(_HEAD.size)
    if len(head) < _HEAD.size:
        return None
    kind, length, checksum = _HEAD.unpack(head)
    content = file.read(min(length, _LONGEST))
    is_whole = len(content) == length and zlib.crc32(content, kind[0]) == checksum
    return (kind, content) if is_whole else None


def _read(kind: bytes, content: bytes, beams: dict[int, list[NDArray[np.float64]]]) -> Entry | None:
    """The entry of a record; None if it only adds a laser's ``beams``, for the scans after it."""
    if kind == b"S":
        return _scan(content, beams)
    if kind == b"O":
        stamp, *numbers = _ODOMETRY.unpack(content)
        return Odometry(stamp, np.array(numbers[:3]), np.array(numbers[3:]))
    if kind == b"Y":
        return YawRate(*_YAW_RATE.unpack(content))
    if kind == b"P":
        return _PLACE.validate_json(content)
    if kind == b"A":
        return AnotherDrive()
    laser, count = _BEAMS.unpack_from(content)
    beams[laser] = [*np.frombuffer(content, "<f8", 2 * count, _BEAMS.size).reshape(2, count).copy()]
    return None


def _scan_bytes(scan: Scan) -> bytes:
    short, cloud = scan.ranges.astype(np.float32), scan.cloud
    is_exact = np.array_equal(short, scan.ranges, equal_nan=True)  # most lasers send no more than 32 bits
    ranges = short if is_exact else scan.ranges
    points = -1 if cloud is None else len(cloud.points)
    head = (scan.stamp, scan.laser, *scan.base_from_laser, scan.max_range, ranges.dtype.char.encode(), points)
    rest = b"" if cloud is None else cloud.points.tobytes() + cloud.time_offsets.tobytes()
    return _SCAN.pack(*head) + ranges.tobytes() + rest


def _scan(content: bytes, beams: dict[int, list[NDArray[np.float64]]]) -> Scan:
    stamp, laser, *numbers, kind, points = _SCAN.unpack_from(content)
    bearings, time_offsets = beams[laser]
    place, max_range = np.array(numbers[:3]), numbers[3]
    ranges = np.frombuffer(content, kind.decode(), len(bearings), _SCAN.size)
    rest = np.frombuffer(content, np.float32, offset=_SCAN.size + ranges.nbytes).copy()
    cloud = None if points < 0 else Cloud(rest[: 3 * points].reshape(points, 3), rest[3 * points :])
    return Scan(stamp, bearings, ranges.astype(np.float64), time_offsets, place, max_range, cloud, laser)
