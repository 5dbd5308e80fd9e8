"""End points of a scan: evenly downsampled and deskewed."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, compose, inverse, transform_points
from racecar.sensors.scan import Scan

PosesAt = Callable[[NDArray[np.int64]], Pose]
"""Poses of the base (N, 3) at stamps (N,) in nanoseconds, in a fixed frame."""

_LONGEST_SWEEP = 1.0
"""Seconds, since lasers turn five times a second or more; longer or non-finite beam times are wrong, and all
beams are then taken at the stamp."""
_FARTHEST = 1e6
"""Metres from which a beam hit nothing. Chosen by judgement, beyond any map, and small enough for the
kernels' integers, which would overflow."""


@dataclass(frozen=True, eq=False)
class EndPoints:
    """Deskewed end points of beams, at the scan's stamp."""

    in_base: NDArray[np.float64]
    """(N, 2) metres, in the base frame."""
    laser: NDArray[np.float64]
    """(2,) position of the laser, likewise."""

    def __len__(self) -> int:
        return len(self.in_base)

    def only(self, chosen: NDArray[np.int64] | NDArray[np.bool_]) -> "EndPoints":
        """The selected points, by index or mask (N,)."""
        return EndPoints(self.in_base[chosen], self.laser)

    def thinned(self, count: int) -> "EndPoints":
        """At most ``count`` points, evenly."""
        return self.only(evenly(len(self), count))


def select_points(scan: Scan, count: int, poses_at: PosesAt) -> EndPoints:
    """End points of up to ``count`` beams, evenly over the scan, so that points on a wall have the same
    spacing whatever else the laser sees.

    ``poses_at`` gives the motion during the sweep. Misses are ignored, since glass causes them too.
    """
    measured = np.flatnonzero(np.isfinite(scan.bearings) & (scan.ranges >= 0.0))
    chosen = measured[evenly(len(measured), count)]
    chosen = chosen[scan.ranges[chosen] < _FARTHEST]
    bearings, ranges, offsets = scan.bearings[chosen], scan.ranges[chosen], scan.time_offsets[chosen]
    if offsets.any() and np.abs(offsets).max() < _LONGEST_SWEEP:
        fixed_from_base = poses_at(scan.stamp + np.rint(1e9 * np.append(offsets, 0.0)).astype(np.int64))
    else:
        fixed_from_base = np.zeros((len(chosen) + 1, 3))
    x, y, yaw = compose(fixed_from_base[:-1], scan.base_from_laser).T
    points = np.column_stack([x + ranges * np.cos(yaw + bearings), y + ranges * np.sin(yaw + bearings)])
    laser = np.array(scan.base_from_laser[:2])  # numba would recompile for a read-only array
    return EndPoints(transform_points(inverse(fixed_from_base[-1]), points), laser)


@lru_cache(maxsize=64)
def evenly(total: int, count: int) -> NDArray[np.int64]:
    """(min(count, total),) evenly spaced indices from 0 to ``total`` - 1."""
    chosen = np.linspace(0, total - 1, min(count, total)).round().astype(np.int64)
    chosen.flags.writeable = False
    return chosen
