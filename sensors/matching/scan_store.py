"""Prepared scans, sorted by bearing with normals, packed for the matching kernels."""

from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.sensors.arrays import Arrays, unpack
from racecar.sensors.matching.line_fitting import fit_lines
from racecar.sensors.matching.scan_matching_kernels import (
    TABLE_SIZE,
    UNIT,
    PackedScans,
    fill_bearing_table,
)

MAX_POINTS = 361
"""Beams kept per scan, half a degree over 180°, since kernels take rows of one length; denser scans are
downsampled after normals are estimated."""

_BY_ROW = ("_points", "_normals", "_counts", "_tables")
_ROOM = 256
"""Spare rows per reallocation, since doubling could waste as much memory again; copying a few hundred is
rare."""


@dataclass(frozen=True, eq=False)
class PreparedScan:
    """Returns of one scan in the laser frame at its stamp."""

    points: NDArray[np.float32]
    """(N, 2) metres, in ascending order of bearing; noise is smoothed along straight surfaces."""
    normals: NDArray[np.float32]
    """(N, 2) unit vectors towards the sensor, (0, 0) where the surface is not straight."""


def prepare_scan(points_in_laser: NDArray[np.float64]) -> PreparedScan:
    """Sort points (N, 2) by bearing, fit lines to them and keep at most ``MAX_POINTS``."""
    points = points_in_laser[_bearing_order(points_in_laser)].astype(np.float32)
    on_lines, normals = np.empty_like(points), np.empty_like(points)
    fit_lines(points, on_lines, normals)
    order = _bearing_order(on_lines)[:: _step(len(points))]
    return PreparedScan(on_lines[order], normals[order])


def thin(points_in_laser: NDArray[np.float64]) -> NDArray[np.float64]:
    """Downsample points (N, 2) to at most ``MAX_POINTS``, evenly by bearing."""
    step = _step(len(points_in_laser))
    return points_in_laser[_bearing_order(points_in_laser)[::step]] if step > 1 else points_in_laser


def _bearing_order(points: NDArray[np.floating[Any]]) -> NDArray[np.int64]:
    return np.argsort(np.arctan2(points[:, 1], points[:, 0]), kind="stable")


def _step(count: int) -> int:
    return max(1, -(-count // MAX_POINTS))


class ScanStore:
    """A growing array of prepared scans. Trimmed scans behave as if they had no points."""

    def __init__(self, capacity: int = 64) -> None:
        self._row_of = np.zeros(capacity, dtype=np.int32)
        self._size = 0
        self._points = np.zeros((capacity + 1, MAX_POINTS, 2), dtype=np.float32)
        self._normals = np.zeros((capacity + 1, MAX_POINTS, 2), dtype=np.int16)
        self._counts = np.zeros(capacity + 1, dtype=np.int32)
        self._tables = np.zeros((capacity + 1, TABLE_SIZE + 1), dtype=np.int16)
        self._rows = 1

    def __len__(self) -> int:
        return self._size

    @property
    def row_of(self) -> NDArray[np.int32]:
        """(K,) row of `packed` for each scan; row 0 belongs to all scans without points."""
        return self._row_of[: self._size]

    @property
    def is_kept(self) -> NDArray[np.bool_]:
        """(K,) whether a scan's points are kept."""
        return self.row_of > 0

    def packed(self) -> PackedScans:
        """All rows, as the kernels take them."""
        rows = slice(self._rows)
        return PackedScans(self._points[rows], self._normals[rows], self._counts[rows], self._tables[rows])

    def points_of(self, index: int) -> NDArray[np.float32]:
        """(N, 2) points of one scan in its laser frame."""
        row = self._row_of[index]
        return self._points[row, : self._counts[row]]

    def add(self, scan: PreparedScan) -> int:
        """Append a scan; returns its index."""
        if self._size == len(self._row_of):
            self._row_of = _with_room(self._row_of, 2 * self._size)
        self._row_of[self._size] = self._fill_row(scan) if len(scan.points) else 0
        self._size += 1
        return self._size - 1

    def cut(self, size: int) -> None:
        """Remove scans from index ``size`` on, which no copy of the store may share."""
        self._rows -= int(np.count_nonzero(self._row_of[size : self._size]))
        self._size = size

    def trim(self, indices: NDArray[np.int64]) -> None:
        """Drop the points of some scans. Their memory is freed once no copy of the store uses it."""
        row_of = self.row_of.copy()
        row_of[indices] = 0
        kept = np.flatnonzero(row_of)
        kept_rows = np.append(0, row_of[kept])
        row_of[kept] = np.arange(1, len(kept_rows))
        self._row_of, self._rows = _with_room(row_of, len(self._row_of)), len(kept_rows)
        for name in _BY_ROW:
            rows = getattr(self, name)
            setattr(self, name, _with_room(rows[kept_rows], len(kept_rows) + _ROOM))

    def only(self, chosen: NDArray[np.bool_]) -> "ScanStore":
        """A store of the chosen scans (K,)."""
        store = copy(self)
        store.trim(np.flatnonzero(~chosen))
        store._row_of, store._size = store.row_of[chosen], int(np.count_nonzero(chosen))
        return store

    def extend(self, other: "ScanStore") -> None:
        """Append all scans of another store."""
        points, normals, counts, _ = other.packed()
        for row in other.row_of.tolist():
            meant = slice(counts[row])
            self.add(PreparedScan(points[row, meant], _of_unit_length(normals[row, meant])))

    def to_arrays(self) -> Arrays:
        """Points and normals of all scans, concatenated, and the number of each."""
        points, normals, counts, _ = self.packed()
        kept = self.row_of[self.is_kept]
        is_meant = np.arange(MAX_POINTS) < counts[kept, None]
        return {
            "points": points[kept][is_meant],
            "normals": _of_unit_length(normals[kept][is_meant]),
            "counts": counts[self.row_of].astype(np.int16),
        }

    @classmethod
    def from_arrays(cls, arrays: Arrays) -> "ScanStore":
        """Rebuild a store from `to_arrays`."""
        store = cls(max(int(np.count_nonzero(arrays["counts"])), 64))
        points = unpack(arrays["points"].astype(np.float32), arrays["counts"])
        normals = unpack(arrays["normals"].astype(np.float32), arrays["counts"])
        for scan in zip(points, normals, strict=True):
            store.add(PreparedScan(*scan))
        return store

    def _fill_row(self, scan: PreparedScan) -> int:
        if self._rows == len(self._counts):
            for name in _BY_ROW:
                setattr(self, name, _with_room(getattr(self, name), self._rows + _ROOM))
        row, count = self._rows, len(scan.points)
        self._points[row, :count] = scan.points
        self._normals[row, :count] = np.rint(scan.normals * UNIT)
        self._counts[row] = count
        fill_bearing_table(self._points[row, :count], self._tables[row])
        self._rows += 1
        return row


def _of_unit_length(normals: NDArray[np.int16]) -> NDArray[np.float32]:
    return (normals / UNIT).astype(np.float32)


def _with_room(array: NDArray[Any], capacity: int) -> NDArray[Any]:
    """The array padded with zeros to ``capacity`` rows."""
    grown = np.zeros((capacity, *array.shape[1:]), dtype=array.dtype)
    grown[: len(array)] = array
    return grown
