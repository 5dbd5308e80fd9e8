"""The beams of a scan that are weighed: few, evenly taken, and corrected for the car's motion."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from maps.scan import Scan
from maps.se2 import Pose, between, compose

OdometryAt = Callable[[NDArray[np.int64]], Pose]
"""``odom_from_base`` (N, 3) at stamps (N,) in nanoseconds."""


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
    def end_points(self) -> NDArray[np.float64]:
        """(M, 2) where the returns end, in the laser frame at the stamp."""
        is_return = np.isfinite(self.ranges)
        ranges, bearings = self.ranges[is_return], self.bearings[is_return]
        return np.column_stack([ranges * np.cos(bearings), ranges * np.sin(bearings)])

    def thinned(self, count: int) -> "Beams":
        """At most ``count`` of them, evenly taken."""
        chosen = _evenly(len(self), count)
        return replace(self, bearings=self.bearings[chosen], ranges=self.ranges[chosen])


def select_beams(scan: Scan, count: int, odometry_at: OdometryAt | None) -> Beams:
    """Up to ``count`` beams evenly over those that carry information, set back by the motion since the stamp.

    The motion during the sweep comes from the odometry; without it the car is taken to stand.
    """
    useful = np.flatnonzero(~np.isnan(scan.ranges) & np.isfinite(scan.bearings) & (scan.ranges >= 0.0))
    chosen = useful[_evenly(len(useful), count)]
    bearings, ranges = scan.bearings[chosen], scan.ranges[chosen]
    offsets = scan.time_offsets[chosen]
    if odometry_at is not None and len(chosen) and np.ptp(offsets) + abs(offsets[0]) > 0:
        laser_from_moved_laser = _motion_since_stamp(scan, offsets, odometry_at)
        bearings, ranges = _seen_from_stamp(bearings, ranges, laser_from_moved_laser)
    return Beams(bearings, ranges, scan.base_from_laser, scan.max_range)


def _evenly(total: int, count: int) -> NDArray[np.int64]:
    return np.linspace(0, total - 1, min(count, total)).round().astype(np.int64)


def _motion_since_stamp(scan: Scan, offsets: NDArray[np.float64], odometry_at: OdometryAt) -> Pose:
    """(B, 3) ``laser_from_moved_laser``: the laser at each beam's time, seen from the laser at the stamp."""
    stamps = scan.stamp + np.rint(offsets * 1e9).astype(np.int64)
    odom_from_base = odometry_at(np.append(stamps, scan.stamp))
    odom_from_laser = compose(odom_from_base, scan.base_from_laser)
    return between(odom_from_laser[-1], odom_from_laser[:-1])


def _seen_from_stamp(
    bearings: NDArray[np.float64], ranges: NDArray[np.float64], laser_from_moved_laser: Pose
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Bearings and ranges (B,) of the same end points from the laser at the stamp; misses are only turned."""
    directions = bearings + laser_from_moved_laser[:, 2]
    hit = np.isfinite(ranges)
    reach = np.where(hit, ranges, 0.0)
    x = laser_from_moved_laser[:, 0] + reach * np.cos(directions)
    y = laser_from_moved_laser[:, 1] + reach * np.sin(directions)
    return np.where(hit, np.arctan2(y, x), directions), np.where(hit, np.hypot(x, y), ranges)
