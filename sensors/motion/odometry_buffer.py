"""A bounded buffer of the latest wheel odometry samples, interpolated at any stamp."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from racecar.maps.geometry.se2 import IDENTITY, Pose
from racecar.sensors.motion.recent_rows import RecentRows
from racecar.sensors.odometry import FASTEST, Odometry, is_jump

STALE_AFTER = 500_000_000
"""Nanoseconds after the last sample for which odometry is valid. Chosen by judgement: much longer than the
period of any odometry (10 to 100 ms), so a few lost messages do no harm, and short compared with a drive."""
_WIDEST_GAP, _NEAR_A_GAP = 1_000_000_000, 100_000_000
"""Nanoseconds between two samples over which poses are interpolated, and how near to either end of a longer
gap a pose is still valid. Chosen by judgement: a car can turn round in a second, but hardly move within a
tenth of one."""
_REPEATS = 3
"""Equal poses that are no coincidence: two may be one sample sent twice. Chosen by judgement."""
_STANDING: Pose = IDENTITY.copy()  # a read-only array would trigger another compilation


class Extrapolation(NamedTuple):
    """How the car is assumed to move past the last sample: at its last speed, for a limited time."""

    longest: int
    """Nanoseconds, in addition to the lag of the samples."""
    speed_over: int
    """Nanoseconds: the speed is the mean since the latest sample this much older, or any older one."""
    widest_gap: int
    """Nanoseconds: samples farther apart do not define a speed."""


STAND_STILL = Extrapolation(longest=0, speed_over=100_000_000, widest_gap=np.iinfo(np.int64).max)
"""The car stands past the last sample, because extrapolation turns a gap in a log into a jump. Only late
samples are extrapolated, by their lag, at the speed over a tenth of a second, so that samples stamped in a
bunch do not distort it."""


class OdometryBuffer(RecentRows):
    """Samples in time order. Supports any number of readers or one writer, but not both at once."""

    def __init__(
        self, max_samples: int = 4096, lag: int = 0, extrapolation: Extrapolation = STAND_STILL
    ) -> None:
        super().__init__(3, max_samples)
        self.lag = lag
        """Nanoseconds by which samples are stamped late."""
        self.extrapolation = extrapolation
        """How the car moves past the last sample."""
        self._known_speed: Pose | None = None

    @property
    def latest_pose(self) -> Pose:
        """``odom_from_base`` (3,) at the latest stamp. Raises LookupError while empty."""
        if not self._end:
            raise LookupError("no odometry yet")
        latest: Pose = self._rows[-1].copy()
        return latest

    @property
    def samples(self) -> tuple[NDArray[np.int64], Pose]:
        """Stamps (N,) in nanoseconds and ``odom_from_base`` (N, 3) of all samples kept."""
        return self._stamps.copy(), self._rows.copy()

    def jumps_to(self, odometry: Odometry) -> bool:
        """Whether a sample does not continue the previous one because its poses have another origin."""
        latest = self.latest_stamp
        if latest is None:
            return False
        seconds = (odometry.stamp - latest) * 1e-9
        return seconds > 0.0 and is_jump(self._rows[-1], odometry.odom_from_base, seconds)

    def add(self, odometry: Odometry) -> None:
        """Add a sample; one that is not newer than the last is ignored."""
        latest = self.latest_stamp
        if latest is not None and odometry.stamp <= latest:
            return
        self._append(odometry.stamp, odometry.odom_from_base)
        self._known_speed = None

    def repeats_since(self, stamp: int, *, heading_only: bool = False) -> int | None:
        """Nanoseconds of the first of the samples before a stamp that all have the exact same pose, or
        heading, as when the car stands or its driver hangs; None if there are too few."""
        if not self.covers(stamp):
            return None
        poses = self._rows[: int(np.searchsorted(self._stamps, stamp + self.lag, side="right"))]
        parts = poses[:, 2:] if heading_only else poses
        if len(parts) < _REPEATS or (parts[-_REPEATS:] != parts[-1]).any():
            return None
        differ = np.flatnonzero((parts != parts[-1]).any(axis=1))
        return int(self._stamps[int(differ[-1]) + 1 if len(differ) else 0])

    def covers(self, stamp: int) -> bool:
        """Whether samples are near enough to a stamp (nanoseconds) for `pose_at` to be valid."""
        latest = self.latest_stamp
        if latest is None or stamp - latest > STALE_AFTER:
            return False
        stamps, wanted = self._stamps, stamp + self.lag
        after = int(np.searchsorted(stamps, wanted, side="right"))
        if after == len(stamps):
            return True
        to_next = int(stamps[after]) - wanted
        if after == 0:
            return to_next <= _NEAR_A_GAP
        since_last = wanted - int(stamps[after - 1])
        return since_last + to_next <= _WIDEST_GAP or min(since_last, to_next) <= _NEAR_A_GAP

    def pose_at(self, stamps: ArrayLike) -> Pose:
        """``odom_from_base`` (..., 3) at stamps (...) in nanoseconds.

        Poses are interpolated between samples, constant before the first, and extrapolated past the last by
        the `Extrapolation`. Raises LookupError while empty.
        """
        if not self._end:
            raise LookupError("no odometry yet")
        wanted = np.asarray(stamps, dtype=np.int64)
        ahead = max(self.lag, 0) + self.extrapolation.longest
        speed = self._last_speed() if ahead > 0 else _STANDING
        poses = poses_at(self._stamps, self._rows, wanted.ravel(), self.lag, speed, ahead)
        return poses if wanted.ndim == 1 else poses.reshape(*wanted.shape, 3)

    def _last_speed(self) -> Pose:
        """(3,) metres and radians per nanosecond, in the car's frame at the last sample."""
        if self._known_speed is None:
            policy = self.extrapolation
            self._known_speed = last_speed(
                self._stamps, self._rows, policy.speed_over, policy.widest_gap, FASTEST
            )
        return self._known_speed


@njit(cache=True, nogil=True)
def poses_at(
    stamps: NDArray[np.int64],
    poses: Pose,
    wanted: NDArray[np.int64],
    lag: int,
    last_speed: Pose,
    longest_ahead: int,
) -> Pose:
    """Poses (W, 3) at requested stamps (W,), from poses (N, 3) at ascending stamps (N,).

    All times are in nanoseconds; samples are stamped late by ``lag``. Past the last sample the car moves at
    ``last_speed`` (3,), metres and radians per nanosecond in its own frame, for at most ``longest_ahead``.
    """
    found = np.empty((len(wanted), 3))
    last = len(stamps) - 1
    is_past = len(wanted) == 0 or np.min(wanted) + lag >= stamps[last]
    for i in range(len(wanted)):
        at = wanted[i] + lag
        if is_past or last == 0:
            found[i] = poses[last]
        else:
            right = min(max(np.searchsorted(stamps, at, side="right"), 1), last)
            left = right - 1
            share = min(max((at - stamps[left]) / (stamps[right] - stamps[left]), 0.0), 1.0)
            found[i, 0] = poses[left, 0] + share * (poses[right, 0] - poses[left, 0])
            found[i, 1] = poses[left, 1] + share * (poses[right, 1] - poses[left, 1])
            found[i, 2] = _wrapped(poses[left, 2] + share * _wrapped(poses[right, 2] - poses[left, 2]))
        if longest_ahead > 0:
            ahead = min(max(at - stamps[last], 0), longest_ahead)
            x, y = ahead * last_speed[0], ahead * last_speed[1]
            cos, sin = math.cos(found[i, 2]), math.sin(found[i, 2])
            found[i, 0] = found[i, 0] + cos * x - sin * y
            found[i, 1] = found[i, 1] + sin * x + cos * y
            found[i, 2] = _wrapped(found[i, 2] + ahead * last_speed[2])
    return found


@njit(cache=True, nogil=True)
def last_speed(
    stamps: NDArray[np.int64], poses: Pose, speed_over: int, widest_gap: int, fastest: float
) -> Pose:
    """(3,) metres and radians per nanosecond, in the car's frame at the last of poses (N, 3) at stamps (N,).

    The mean since the latest sample that is ``speed_over`` nanoseconds older, or since any older one. Zero if
    these are ``widest_gap`` or more apart, or faster than ``fastest`` per second, which is no real motion.
    """
    last = len(stamps) - 1
    if last < 1:
        return np.zeros(3)
    older = np.searchsorted(stamps, stamps[last] - speed_over, side="right") - 1
    before = min(max(older, 0), last - 1)
    gap = stamps[last] - stamps[before]
    if gap >= widest_gap:
        return np.zeros(3)
    speed = _between(poses[before], poses[last]) / gap
    return speed if np.max(np.abs(speed)) * 1e9 < fastest else np.zeros(3)


@njit(cache=True, nogil=True)
def _between(world_from_a: Pose, world_from_b: Pose) -> Pose:
    """``a_from_b`` (3,), rounded exactly as `racecar.maps.geometry.se2.between` does."""
    x, y, yaw = world_from_a
    cos, sin = math.cos(yaw), math.sin(yaw)
    a_from_world_x, a_from_world_y, turn = -cos * x - sin * y, sin * x - cos * y, _wrapped(-yaw)
    cos, sin = math.cos(turn), math.sin(turn)
    x, y, yaw = world_from_b
    return np.array(
        [a_from_world_x + cos * x - sin * y, a_from_world_y + sin * x + cos * y, _wrapped(turn + yaw)]
    )


@njit(cache=True, nogil=True)
def _wrapped(angle: float) -> float:
    """The same angle in (-π, π], rounded exactly as `racecar.maps.geometry.se2.wrap_angle` does, so that
    poses match those of `interpolate` and `compose` there to the bit."""
    return math.pi - (math.pi - angle) % (2.0 * math.pi)
