"""The end points of a scan: few, evenly taken, and corrected for the car's motion."""

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
"""Seconds, since lasers turn five times a second or more; where the times of beams span more, or are not
numbers, they are wrong, and all beams count as taken at the stamp."""
_FARTHEST = 1e6
"""Metres from which a beam met nothing: by judgement, beyond any map, and far below what the kernels' numbers
can no longer hold, so that they would look up what is no number."""


@dataclass(frozen=True, eq=False)
class EndPoints:
    """Where beams met something, as if all had been taken at the scan's stamp."""

    in_base: NDArray[np.float64]
    """(N, 2) metres, in the base frame."""
    laser: NDArray[np.float64]
    """(2,) where the laser is, likewise."""

    def __len__(self) -> int:
        return len(self.in_base)

    def only(self, chosen: NDArray[np.int64] | NDArray[np.bool_]) -> "EndPoints":
        """Those chosen, by number or by a mask (N,)."""
        return EndPoints(self.in_base[chosen], self.laser)

    def thinned(self, count: int) -> "EndPoints":
        """At most ``count`` of them, evenly taken."""
        return self.only(evenly(len(self), count))


def select_points(scan: Scan, count: int, poses_at: PosesAt) -> EndPoints:
    """The end points of up to ``count`` beams, evenly over the scan, so that those on one wall lie as far
    apart whatever else the laser sees.

    ``poses_at`` gives the motion during the sweep. Misses say nothing, since glass swallows beams, too.
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
    laser = np.array(scan.base_from_laser[:2])  # numba would compile again for a read-only one
    return EndPoints(transform_points(inverse(fixed_from_base[-1]), points), laser)


@lru_cache(maxsize=64)
def evenly(total: int, count: int) -> NDArray[np.int64]:
    """(min(count, total),) numbers from 0 to ``total`` - 1."""
    chosen = np.linspace(0, total - 1, min(count, total)).round().astype(np.int64)
    chosen.flags.writeable = False
    return chosen
