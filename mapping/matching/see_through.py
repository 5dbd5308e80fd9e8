"""Verification of a loop closure that is independent of how it was found: the see-through test.

If two scans see the same place from the poses claimed, one's points must lie on the other's surfaces or
hidden behind them. A point that the other scan looks through refutes the claim.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.matching.scan_store import ScanStore
from racecar.mapping.matching.see_through_kernels import count_see_through
from racecar.maps.geometry.se2 import Pose, between

_MAX_RANGE = 20.0
_TOLERANCE = 0.12
_MAX_GAP = np.deg2rad(2.5)


@dataclass(frozen=True)
class SeeThrough:
    """How the points of all scan pairs fared."""

    on_surface: int
    looked_through: int
    untold: int

    @property
    def agreement(self) -> float:
        """Share of the judged points that lie on a surface."""
        return self.on_surface / max(self.on_surface + self.looked_through, 1)

    @property
    def coverage(self) -> float:
        """Share of all points that lie on a surface."""
        return self.on_surface / max(self.on_surface + self.looked_through + self.untold, 1)


def see_through(store: ScanStore, pairs: NDArray[np.int64], first: Pose, second: Pose) -> SeeThrough:
    """Judge scan pairs (P, 2) of ``store``, at ``first`` and ``second`` (P, 3) in one frame, both ways."""
    tally = np.zeros(3, dtype=np.int64)
    points, _, counts, tables = store.packed()
    first_from_second = between(first, second)
    second_from_first = between(second, first)
    for k, (a, b) in enumerate(store.row_of[pairs]):
        for viewed, viewer, pose in ((a, b, second_from_first[k]), (b, a, first_from_second[k])):
            count_see_through(
                points[viewed], counts[viewed], pose, points[viewer], counts[viewer], tables[viewer],
                _MAX_RANGE, _TOLERANCE, _MAX_GAP, tally,
            )  # fmt: skip
    return SeeThrough(int(tally[0]), int(tally[1]), int(tally[2]))
