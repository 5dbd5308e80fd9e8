"""Prepared scans: points sorted by bearing with their normals, packed for the matching kernels."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapping.arrays import Arrays, unpack
from mapping.scan_matching_kernels import TABLE_SIZE, fill_bearing_table, fit_lines

MAX_POINTS = 361
"""Beams kept of a scan: half a degree over 180°; denser scans are thinned once the normals are known."""

_HALF_ANGLE = np.deg2rad(3.0)
_HALF_WIDTH = 0.12
_MAX_GAP_ANGLE = np.deg2rad(8.0)
_MIN_GAP = 0.15
_MAX_RMS = 0.04


@dataclass(frozen=True, eq=False)
class PreparedScan:
    """The returns of one scan in the laser frame at its stamp."""

    points: NDArray[np.float32]
    """(N, 2) metres, ascending in bearing; noise is smoothed along straight surfaces."""
    normals: NDArray[np.float32]
    """(N, 2) unit vectors towards the sensor, (0, 0) where the surface is not straight."""


def prepare_scan(points_in_laser: NDArray[np.float64]) -> PreparedScan:
    """Sort points (N, 2) by bearing, fit lines to them and thin to at most ``MAX_POINTS``."""
    points = points_in_laser[_bearing_order(points_in_laser)].astype(np.float32)
    on_lines, normals = np.empty_like(points), np.empty_like(points)
    fit_lines(points, _HALF_ANGLE, _HALF_WIDTH, _MAX_GAP_ANGLE, _MIN_GAP, _MAX_RMS, on_lines, normals)
    order = _bearing_order(on_lines)[:: _step(len(points))]
    return PreparedScan(on_lines[order], normals[order])


def thin(points_in_laser: NDArray[np.float64]) -> NDArray[np.float64]:
    """At most ``MAX_POINTS`` of points (N, 2), evenly by bearing."""
    step = _step(len(points_in_laser))
    return points_in_laser[_bearing_order(points_in_laser)[::step]] if step > 1 else points_in_laser


def _bearing_order(points: NDArray[np.floating[Any]]) -> NDArray[np.int64]:
    return np.argsort(np.arctan2(points[:, 1], points[:, 0]), kind="stable")


def _step(count: int) -> int:
    return max(1, -(-count // MAX_POINTS))


class ScanStore:
    """A growing array of prepared scans; scan ``k`` is row ``k`` of each array."""

    def __init__(self, capacity: int = 64) -> None:
        self._points = np.zeros((capacity, MAX_POINTS, 2), dtype=np.float32)
        self._normals = np.zeros((capacity, MAX_POINTS, 2), dtype=np.float32)
        self._counts = np.zeros(capacity, dtype=np.int32)
        self._tables = np.zeros((capacity, TABLE_SIZE + 1), dtype=np.int16)
        self._size = 0

    def __len__(self) -> int:
        return self._size

    @property
    def points(self) -> NDArray[np.float32]:
        """(K, MAX_POINTS, 2); only the first ``counts[k]`` of row k are meant."""
        return self._points[: self._size]

    @property
    def normals(self) -> NDArray[np.float32]:
        """(K, MAX_POINTS, 2)"""
        return self._normals[: self._size]

    @property
    def counts(self) -> NDArray[np.int32]:
        """(K,)"""
        return self._counts[: self._size]

    @property
    def tables(self) -> NDArray[np.int16]:
        """(K, TABLE_SIZE + 1) bearing tables."""
        return self._tables[: self._size]

    def packed(
        self,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int32], NDArray[np.int16]]:
        """Points, normals, counts and bearing tables, as the matching kernels take them."""
        return self.points, self.normals, self.counts, self.tables

    def points_of(self, index: int) -> NDArray[np.float32]:
        """(N, 2) points of one scan in its laser frame."""
        return self._points[index, : self._counts[index]]

    def add(self, scan: PreparedScan) -> int:
        """Append; returns the scan's index."""
        if self._size == len(self._counts):
            self._grow()
        index, count = self._size, len(scan.points)
        self._points[index, :count] = scan.points
        self._normals[index, :count] = scan.normals
        self._counts[index] = count
        fill_bearing_table(self._points[index, :count], self._tables[index])
        self._size += 1
        return index

    def extend(self, other: "ScanStore") -> None:
        """Append all scans of another store."""
        for points, normals, count in zip(other.points, other.normals, other.counts, strict=True):
            self.add(PreparedScan(points[:count], normals[:count]))

    def to_arrays(self) -> Arrays:
        """Points and normals of all scans, one after the other, and how many each has."""
        is_meant = np.arange(MAX_POINTS) < self.counts[:, None]
        return {
            "points": self.points[is_meant],
            "normals": self.normals[is_meant],
            "counts": self.counts.astype(np.int16),
        }

    @classmethod
    def from_arrays(cls, arrays: Arrays) -> "ScanStore":
        """The store that was written so."""
        store = cls(max(len(arrays["counts"]), 64))
        points = unpack(arrays["points"].astype(np.float32), arrays["counts"])
        normals = unpack(arrays["normals"].astype(np.float32), arrays["counts"])
        for scan in zip(points, normals, strict=True):
            store.add(PreparedScan(*scan))
        return store

    def _grow(self) -> None:
        # Zeros that nobody has written to take no memory yet.
        for name in ("_points", "_normals", "_counts", "_tables"):
            old = getattr(self, name)
            grown = np.zeros((2 * len(old), *old.shape[1:]), dtype=old.dtype)
            grown[: len(old)] = old
            setattr(self, name, grown)
