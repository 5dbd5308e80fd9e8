"""See-through test: verify a loop closure independently of how it was found.

If two scans see the same place from their assumed poses, points of one lie on the other's surfaces or are
occluded. A point that the other scan sees through contradicts the loop closure.
"""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, between
from racecar.sensors.matching.scan_matching_kernels import TABLE_SIZE
from racecar.sensors.matching.scan_store import ScanStore

_MIN_RANGE, _MAX_RANGE = 0.3, 20.0
"""Range in metres from the viewer in which points are judged, because closer the car itself and noisy
bearings mislead, and farther away beams are sparse."""
_TOLERANCE = 0.12
"""Metres before or behind a surface that count as on it. Chosen by judgement: drift within a submap plus
noise."""
_TOLERANCE_PER_METRE = 0.02
"""Growth of that tolerance per metre of range. Chosen by judgement: one degree of heading error on a surface
at 45 degrees."""
_MAX_GAP = math.radians(2.5)
"""Radians between two returns of the viewer up to which the space between is known. Chosen by judgement: one
missing beam of a laser of one degree."""
_SPACINGS = 1.5
"""The same as a multiple of the viewer's usual spacing, because sparse lasers would otherwise decide nothing:
less than one missing beam."""


@dataclass(frozen=True)
class SeeThrough:
    """Counts of points over all scan pairs."""

    on_surface: int
    looked_through: int
    undecided: int

    @property
    def agreement(self) -> float:
        """Share of judged points on a surface."""
        return self.on_surface / max(self.on_surface + self.looked_through, 1)

    @property
    def coverage(self) -> float:
        """Share of all points on a surface."""
        return self.on_surface / max(self.on_surface + self.looked_through + self.undecided, 1)


def see_through(store: ScanStore, pairs: NDArray[np.int64], first: Pose, second: Pose) -> SeeThrough:
    """Judge scan pairs (P, 2) of ``store`` both ways, at ``first`` and ``second`` (P, 3) in one frame."""
    return SeeThrough(*see_through_each(store, pairs, first, second).sum(axis=0).tolist())


def see_through_each(
    store: ScanStore, pairs: NDArray[np.int64], first: Pose, second: Pose
) -> NDArray[np.int64]:
    """(P, 3) counts per pair: points on a surface, seen through, undecided."""
    tallies = np.zeros((len(pairs), 3), dtype=np.int64)
    points, _, counts, tables = store.packed()
    first_from_second = between(first, second)
    second_from_first = between(second, first)
    for k, (a, b) in enumerate(store.row_of[pairs]):
        for viewed, viewer, pose in ((a, b, second_from_first[k]), (b, a, first_from_second[k])):
            _count(
                points[viewed, : counts[viewed]],
                pose,
                points[viewer, : counts[viewer]],
                tables[viewer],
                tallies[k],
            )
    return tallies


@njit(cache=True, nogil=True)
def _count(
    points: NDArray[np.float32],
    viewer_from_points: NDArray[np.float64],
    viewer: NDArray[np.float32],
    viewer_table: NDArray[np.int16],
    tally: NDArray[np.int64],
) -> None:
    """Count points (N, 2) that lie on the viewer's surfaces (M, 2), are seen through or cannot be judged.

    A point is judged where the viewer has beams close by on both sides of its bearing, and it lies either
    beyond or before both returns.
    """
    max_gap = max(_MAX_GAP, _SPACINGS * _usual_spacing(viewer))
    c, s = np.cos(viewer_from_points[2]), np.sin(viewer_from_points[2])
    for i in range(len(points)):
        x = c * points[i, 0] - s * points[i, 1] + viewer_from_points[0]
        y = s * points[i, 0] + c * points[i, 1] + viewer_from_points[1]
        distance = np.sqrt(x * x + y * y)
        if distance > _MAX_RANGE or distance < _MIN_RANGE:
            tally[2] += 1
            continue
        bearing = np.arctan2(y, x)
        j = viewer_table[min(max(int((bearing + np.pi) * TABLE_SIZE / (2.0 * np.pi)), 0), TABLE_SIZE)]
        while j < len(viewer) and np.arctan2(viewer[j, 1], viewer[j, 0]) < bearing:
            j += 1
        if j == 0 or j >= len(viewer):
            tally[2] += 1
            continue
        left = np.arctan2(viewer[j - 1, 1], viewer[j - 1, 0])
        right = np.arctan2(viewer[j, 1], viewer[j, 0])
        if right - left > max_gap:
            tally[2] += 1
            continue
        before = np.sqrt(viewer[j - 1, 0] ** 2 + viewer[j - 1, 1] ** 2)
        after = np.sqrt(viewer[j, 0] ** 2 + viewer[j, 1] ** 2)
        # A point near either return, or near the line that joins them, lies on the surface.
        near, far = min(before, after), max(before, after)
        slack = _TOLERANCE + _TOLERANCE_PER_METRE * distance
        if near - slack <= distance <= far + slack:
            tally[0] += 1
        elif distance < near - slack:
            tally[1] += 1
        else:
            tally[2] += 1


@njit(cache=True, nogil=True)
def _usual_spacing(viewer: NDArray[np.float32]) -> float:
    """Median spacing in radians of the viewer's returns (M, 2); 0 where they are too dense to matter."""
    if len(viewer) < 2 or len(viewer) * _MAX_GAP > 2.0 * np.pi:
        return 0.0
    spacing = np.median(np.diff(np.arctan2(viewer[:, 1], viewer[:, 0])))
    return float(spacing)
