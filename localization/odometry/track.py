"""The latest stretch of odometry, told at any stamp in a few microseconds; its memory is bounded."""

import numpy as np
from numpy.typing import ArrayLike

from racecar.localization.odometry.track_kernels import poses_at
from racecar.maps.geometry.se2 import Pose
from racecar.maps.sensing.odometry import Odometry, is_jump

_KEPT = 4096
_LONGEST_EXTRAPOLATION = 0.1
"""Seconds for which the latest speed is taken to last, while the next sample is on its way."""


class OdometryTrack:
    """Samples in the order of time."""

    def __init__(self) -> None:
        self._stamps = np.empty(2 * _KEPT, dtype=np.int64)
        self._poses = np.empty((2 * _KEPT, 3))
        self._count = 0

    @property
    def latest_stamp(self) -> int | None:
        """Nanoseconds, None while empty."""
        return int(self._stamps[self._count - 1]) if self._count else None

    @property
    def first_stamp(self) -> int | None:
        """Nanoseconds, of the oldest sample that is kept; None while empty."""
        return int(self._stamps[0]) if self._count else None

    def jumps_to(self, odometry: Odometry) -> bool:
        """Whether a sample does not continue the last one: its poses have another origin."""
        if not self._count:
            return False
        seconds = (odometry.stamp - int(self._stamps[self._count - 1])) * 1e-9
        return seconds > 0.0 and is_jump(self._poses[self._count - 1], odometry.odom_from_base, seconds)

    def add(self, odometry: Odometry) -> None:
        """Take a sample; one that is not newer than the last is left out."""
        if self._count and odometry.stamp <= self._stamps[self._count - 1]:
            return
        if self._count == len(self._stamps):
            self._stamps[:_KEPT], self._poses[:_KEPT] = self._stamps[_KEPT:], self._poses[_KEPT:]
            self._count = _KEPT
        self._stamps[self._count], self._poses[self._count] = odometry.stamp, odometry.odom_from_base
        self._count += 1

    def poses_at(self, stamps: ArrayLike) -> Pose:
        """``odom_from_base`` (N, 3) at stamps (N,) in nanoseconds.

        Between samples it is interpolated. Past the latest, its speed lasts for a little; before the first
        that one stands. Raises LookupError while empty.
        """
        if not self._count:
            raise LookupError("no odometry yet")
        return poses_at(
            self._stamps[: self._count],
            self._poses[: self._count],
            np.atleast_1d(np.asarray(stamps, dtype=np.int64)),
            _LONGEST_EXTRAPOLATION,
        )
