"""Estimate the direction of the main walls of a map: most rooms have two, at a right angle."""

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.sensors.matching.scan_store import ScanStore

_QUARTER = np.pi / 2
"""Period of wall directions in radians, because most rooms are rectangular."""
_BINS = 360
"""Histogram bins over a quarter turn, since a quarter of a degree is finer than the normals of one scan."""
_SMOOTHED = 9
"""Bins averaged for a peak: 2.25°, because normals of one straight wall scatter by about that."""
_WITHIN = np.deg2rad([4.0, 2.0, 2.0, 2.0])
"""Radians around the last estimate whose median is the next one. As measured on aces, fr079, intel and
session_A, it moves by less than 0.01° after these, and lies within 0.05° of the turn that makes the
projections of all points on the axes sharpest."""


def wall_direction(store: ScanStore, map_from_laser: Pose) -> float | None:
    """Radians in [-π/4, π/4) between an axis of the map and most lines in scans at poses (K, 3); None where
    no scan shows a line."""
    angles = np.mod(_normal_angles(store, map_from_laser), _QUARTER)
    if len(angles) == 0:
        return None
    counts, _ = np.histogram(angles, _BINS, (0.0, _QUARTER))
    around = np.pad(counts, _SMOOTHED // 2, mode="wrap")
    smooth = np.convolve(around, np.ones(_SMOOTHED), mode="valid")
    direction = (float(np.argmax(smooth)) + 0.5) * _QUARTER / _BINS
    for within in _WITHIN:
        off = _from_quarter(angles - direction)
        direction += float(np.median(off[np.abs(off) < within]))
    return float(_from_quarter(direction))


def _normal_angles(store: ScanStore, map_from_laser: Pose) -> NDArray[np.float64]:
    """Angles in the map, in radians, of the normals of all points on lines."""
    normals = store.packed().normals[store.row_of[store.is_kept]]
    of_scan, on_line = np.nonzero(normals.any(axis=2))
    x, y = normals[of_scan, on_line].T.astype(np.float64)
    return np.asarray(np.arctan2(y, x) + map_from_laser[store.is_kept, 2][of_scan])


def _from_quarter(angles: NDArray[np.float64] | float) -> NDArray[np.float64]:
    """The same wall directions in [-π/4, π/4)."""
    return np.asarray(np.mod(angles + _QUARTER / 2, _QUARTER) - _QUARTER / 2)
