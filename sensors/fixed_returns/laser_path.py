"""Track the laser's pose: by the wheels, or by the scans where it moves while the wheels stand still."""

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, between, compose
from racecar.sensors.fixed_returns.vote_kernels import LIMITS
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.self_calibration.scan_track import middle_of, track_of
from racecar.sensors.self_calibration.wheel_track import WheelTrack

_SECOND = 1_000_000_000
"""Nanoseconds, by definition."""
_STANDS = (0.05, 0.1)
"""Metres and radians in a second below which the wheels stand still. Chosen by judgement: encoder noise."""
_MIN_CHANGED = 0.3
"""Share of ranges changed in that second from which the laser moved nonetheless. Chosen by judgement: more
than people walking by, less than what a carrier leaves of the view."""
_MIN_STANDING = 2
"""Number of such seconds from which scan odometry is used, which is slower. Chosen by judgement: a slow turn
may begin in one."""


def laser_path(scans: list[Scan], odometry: list[Odometry]) -> tuple[Pose, NDArray[np.int64]]:
    """Poses (N, 3) of the laser in the middle of each sweep, and segment ids (N,) within which they are
    comparable.

    Wheels do not notice that a robot is carried, but ranges change. In this case, and without wheels, the
    scans are tracked.
    """
    middle = round(middle_of(scans[0]) * 1e9)
    stamps = np.array([scan.stamp + middle for scan in scans], dtype=np.int64)
    wheels = WheelTrack.of(odometry)
    if len(odometry) >= 2 and bool(wheels.covers(stamps).any()):
        odom_from_base = wheels.at(stamps)
        if not _moves_without_wheels(scans, stamps, odom_from_base):
            return compose(odom_from_base, scans[0].base_from_laser), np.zeros(len(scans), dtype=np.int64)
    track = track_of(scans)
    nearest = np.searchsorted(track.stamps, stamps, side="right") - 1
    poses = track.track_from_laser.copy()
    poses[:, 2] = np.unwrap(poses[:, 2])
    seconds, wanted = (track.stamps - stamps[0]) * 1e-9, (stamps - stamps[0]) * 1e-9
    path = np.column_stack([np.interp(wanted, seconds, part) for part in poses.T])
    return path, track.segment[np.maximum(nearest, 0)]


def _moves_without_wheels(scans: list[Scan], stamps: NDArray[np.int64], odom_from_base: Pose) -> bool:
    """Whether many ranges change in seconds in which the wheels stand still."""
    found, index = 0, 0
    while True:
        later = int(np.searchsorted(stamps, stamps[index] + _SECOND))
        if later >= len(scans):
            return found >= _MIN_STANDING
        step = between(odom_from_base[index], odom_from_base[later])
        if np.hypot(step[0], step[1]) < _STANDS[0] and abs(step[2]) < _STANDS[1]:
            found += _changed(scans[index], scans[later]) > _MIN_CHANGED
        index = later


def _changed(scan: Scan, later: Scan) -> float:
    """Share of ranges that changed by more than the tolerance of fixed returns."""
    if len(scan.ranges) != len(later.ranges):
        return 0.0
    with np.errstate(invalid="ignore"):  # both are misses
        change = np.abs(later.ranges - scan.ranges)
    change = change[np.isfinite(change)]
    return float(np.mean(change > LIMITS.fixed)) if len(change) else 0.0
