"""The beams of a scan that are weighed: few, evenly taken, and corrected for the car's motion."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from racecar.localization.sensor.beams_kernels import knots_of_sweep, points_of, set_back, useful_beams
from racecar.maps.geometry.se2 import Pose
from racecar.maps.sensing.scan import Scan

PosesAt = Callable[[NDArray[np.int64]], Pose]
"""Poses of the base (N, 3) at stamps (N,) in nanoseconds, in a fixed frame."""

_LONGEST_SWEEP = 1.0
"""Seconds, since lasers turn five times a second or more; where the times of beams span more, or are not
numbers, they are wrong, and all beams count as taken at the stamp."""


@dataclass(frozen=True, eq=False)
class Beams:
    """B readings as if all had been taken at the scan's stamp."""

    bearings: NDArray[np.float64]
    """(B,) radians in the laser frame at the stamp."""
    ranges: NDArray[np.float64]
    """(B,) metres, inf for a miss."""
    base_from_laser: Pose
    max_range: float

    def __len__(self) -> int:
        return len(self.bearings)

    @property
    def returns(self) -> "Beams":
        """Those that met something."""
        return self.only(np.isfinite(self.ranges))

    @property
    def end_points(self) -> NDArray[np.float64]:
        """(M, 2) where the returns end, in the laser frame at the stamp."""
        is_return = np.isfinite(self.ranges)
        ranges, bearings = self.ranges[is_return], self.bearings[is_return]
        return np.column_stack([ranges * np.cos(bearings), ranges * np.sin(bearings)])

    @property
    def points_in_base(self) -> NDArray[np.float64]:
        """(M, 2) where the returns end, in the base frame at the stamp."""
        return points_of(self.bearings, self.ranges, self.base_from_laser)

    def thinned(self, count: int) -> "Beams":
        """At most ``count`` of them, evenly taken."""
        return self.only(_evenly(len(self), count))

    def only(self, chosen: NDArray[np.int64] | NDArray[np.bool_]) -> "Beams":
        """Those chosen, by number or by a mask (B,)."""
        return Beams(self.bearings[chosen], self.ranges[chosen], self.base_from_laser, self.max_range)


def select_beams(scan: Scan, count: int, poses_at: PosesAt) -> Beams:
    """Up to ``count`` beams evenly over those that carry information, set back by the motion since the stamp.

    ``poses_at`` gives the motion during the sweep. None are taken of a scan without any return: it is rather
    that of a covered laser than of a hall so wide, and as misses in all directions it contradicts every place
    on the map.
    """
    useful = useful_beams(scan.bearings, scan.ranges)
    if not np.isfinite(scan.ranges[useful]).any():
        useful = useful[:0]
    chosen = useful[_evenly(len(useful), count)]
    bearings, ranges, offsets = scan.bearings[chosen], scan.ranges[chosen], scan.time_offsets[chosen]
    base_from_laser = np.array(scan.base_from_laser)  # numba would compile again for a read-only one
    knots, stamps = knots_of_sweep(offsets, _LONGEST_SWEEP, scan.stamp)
    if len(knots) > 0:
        fixed_from_base = poses_at(stamps)
        bearings, ranges = set_back(bearings, ranges, offsets, knots, fixed_from_base, base_from_laser)
    return Beams(bearings, ranges, base_from_laser, scan.max_range)


@lru_cache(maxsize=64)
def _evenly(total: int, count: int) -> NDArray[np.int64]:
    chosen = np.linspace(0, total - 1, min(count, total)).round().astype(np.int64)
    chosen.flags.writeable = False
    return chosen
