"""Verification of a loop closure that is independent of how it was found: the see-through test.

If two scans see the same place from the poses claimed, one's points must lie on the other's surfaces or
hidden behind them. A point that the other scan looks through refutes the claim.
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
"""Metres from the viewer between which a point is judged, because nearer the car itself and bearings that
jump mislead, and farther off beams lie far apart."""
_TOLERANCE = 0.12
"""Metres before or behind a surface that still count as on it. By judgement: drift within a submap and noise
together."""
_TOLERANCE_PER_METRE = 0.02
"""By how many metres that grows per metre from the viewer. By judgement: one degree of heading on a surface
that is met at 45 degrees."""
_MAX_GAP = math.radians(2.5)
"""Radians between two returns of the viewer, up to which what lies between them is known. By judgement: one
missing beam of a laser of one degree."""
_SPACINGS = 1.5
"""The same in usual spacings of the viewer's returns, because of lasers of few beams nothing would be known
otherwise: no beam is missing."""


@dataclass(frozen=True)
class SeeThrough:
    """How the points of all scan pairs fared."""

    on_surface: int
    looked_through: int
    undecided: int

    @property
    def agreement(self) -> float:
        """Share of the judged points that lie on a surface."""
        return self.on_surface / max(self.on_surface + self.looked_through, 1)

    @property
    def coverage(self) -> float:
        """Share of all points that lie on a surface."""
        return self.on_surface / max(self.on_surface + self.looked_through + self.undecided, 1)


def see_through(store: ScanStore, pairs: NDArray[np.int64], first: Pose, second: Pose) -> SeeThrough:
    """Judge scan pairs (P, 2) of ``store``, at ``first`` and ``second`` (P, 3) in one frame, both ways."""
    return SeeThrough(*see_through_each(store, pairs, first, second).sum(axis=0).tolist())


def see_through_each(
    store: ScanStore, pairs: NDArray[np.int64], first: Pose, second: Pose
) -> NDArray[np.int64]:
    """(P, 3) the same of each pair: points on a surface, looked through, undecided."""
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
    """Add to ``tally``: points (N, 2) that lie on the surfaces of the viewer's (M, 2), that it looks through,
    that it cannot judge.

    A point is judged where the viewer has beams on both sides of its bearing, near enough to each other, and
    it lies beyond both or before both of their returns.
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
        # A point near either return, or between them on the line that joins them, lies on the surface.
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
    """Radians from one of (M, 2) returns to the next, the median; 0 where these are so many that it is no gap
    anyway."""
    if len(viewer) < 2 or len(viewer) * _MAX_GAP > 2.0 * np.pi:
        return 0.0
    spacing = np.median(np.diff(np.arctan2(viewer[:, 1], viewer[:, 0])))
    return float(spacing)
