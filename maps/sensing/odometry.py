"""Wheel odometry: samples, and a buffer that tells the pose at any time between them."""

import math
from collections import deque
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecar.maps.geometry.se2 import Pose, between, compose, interpolate

FASTEST, _LEAST_JUMP = 20.0, 0.5
"""Metres or radians, per second and at once: no car moves so, not even where messages that came in a bunch
were stamped as they came."""

STALE_AFTER = 500_000_000
"""Nanoseconds after the last sample for which it tells where the car is."""
_WIDEST_GAP, _NEAR_A_GAP = 1_000_000_000, 100_000_000
"""Nanoseconds between two samples over which the way may be drawn straight, and how near to either end of a
longer gap a pose still holds."""
_SPEED_OVER = 100_000_000
"""Nanoseconds: samples that were stamped in a bunch tell no speed."""


@dataclass(frozen=True, eq=False)
class Odometry:
    """One odometry message."""

    stamp: int
    """Nanoseconds."""
    odom_from_base: Pose
    """(3,) the pose by dead reckoning."""
    twist: Pose
    """(3,) forward, sideways (m/s) and turning speed (rad/s) in the base frame."""


def is_jump(odom_from_before: Pose, odom_from_after: Pose, seconds: float) -> bool:
    """Whether so little time between two poses (3,) shows that it was not the car that moved.

    Drivers that start anew count from zero, and some filters set their pose when they are told one.
    """
    most = FASTEST * seconds + _LEAST_JUMP
    x, y, turn = (odom_from_after - odom_from_before).tolist()
    return math.hypot(x, y) > most or abs(math.remainder(turn, math.tau)) > most


class OdometryBuffer:
    """The latest stretch of odometry, interpolated at any stamp; its memory is bounded."""

    def __init__(self, max_samples: int = 4096, lag: int = 0) -> None:
        self.lag = lag
        """Nanoseconds by which samples are stamped late."""
        self._samples: deque[tuple[int, Pose]] = deque(maxlen=max_samples)

    def __len__(self) -> int:
        return len(self._samples)

    @property
    def latest_stamp(self) -> int | None:
        """Nanoseconds, None while empty."""
        return self._samples[-1][0] if self._samples else None

    @property
    def samples(self) -> tuple[NDArray[np.int64], Pose]:
        """Stamps (N,) in nanoseconds and ``odom_from_base`` (N, 3), as far back as they are kept."""
        stamps = np.array([stamp for stamp, _ in self._samples], dtype=np.int64)
        return stamps, np.array([pose for _, pose in self._samples]).reshape(-1, 3)

    def jumps_to(self, odometry: Odometry) -> bool:
        """Whether a sample does not continue the last one: its poses have another origin."""
        if not self._samples:
            return False
        stamp, odom_from_base = self._samples[-1]
        seconds = (odometry.stamp - stamp) * 1e-9
        return seconds > 0.0 and is_jump(odom_from_base, odometry.odom_from_base, seconds)

    def add(self, odometry: Odometry) -> bool:
        """Take a sample; False when it is not newer than the last and was left out."""
        if self._samples and odometry.stamp <= self._samples[-1][0]:
            return False
        self._samples.append((odometry.stamp, odometry.odom_from_base))
        return True

    def tells_of(self, stamp: int) -> bool:
        """Whether samples are so near to a stamp (nanoseconds) that `pose_at` is where the car was."""
        latest = self.latest_stamp
        if latest is None or stamp - latest > STALE_AFTER:
            return False
        wanted, after = stamp + self.lag, latest
        for before, _ in reversed(self._samples):
            if before <= wanted:
                is_gap = after - before > _WIDEST_GAP
                return not is_gap or min(wanted - before, after - wanted) <= _NEAR_A_GAP
            after = before
        return after - wanted <= _NEAR_A_GAP

    def pose_at(self, stamps: ArrayLike) -> Pose:
        """``odom_from_base`` (..., 3) at stamps (...) in nanoseconds.

        Between samples the pose is interpolated; outside them the nearest sample stands, because an
        extrapolated speed turns a gap in the log into a jump. Only where samples are late it is carried on at
        the last speed, for as long as they are late. Raises LookupError while empty.
        """
        if not self._samples:
            raise LookupError("no odometry yet")
        wanted = np.asarray(stamps, dtype=np.int64) + self.lag
        pose = self._interpolated(wanted)
        if self.lag <= 0 or len(self._samples) == 1:
            return pose
        late = np.clip(wanted - self._samples[-1][0], 0, self.lag)
        return compose(pose, late[..., None] * self._last_speed())

    def _last_speed(self) -> Pose:
        """The motion (3,) per nanosecond before the last sample."""
        stamp, odom_from_base = self._samples[-1]
        earlier = islice(reversed(self._samples), 1, None)
        far = (sample for sample in earlier if stamp - sample[0] >= _SPEED_OVER)
        before, odom_from_before = next(far, self._samples[0])
        return between(odom_from_before, odom_from_base) / (stamp - before)

    def _interpolated(self, wanted: NDArray[np.int64]) -> Pose:
        first_needed = int(wanted.min())
        recent: list[tuple[int, Pose]] = []
        for sample in reversed(self._samples):
            recent.append(sample)
            if sample[0] <= first_needed:
                break
        recent.reverse()
        if len(recent) == 1:
            return np.broadcast_to(recent[0][1], (*wanted.shape, 3)).copy()
        times = np.array([stamp for stamp, _ in recent], dtype=np.int64)
        poses = np.array([pose for _, pose in recent])
        right = np.clip(np.searchsorted(times, wanted, side="right"), 1, len(times) - 1)
        span = (times[right] - times[right - 1]).astype(np.float64)
        fraction = np.clip((wanted - times[right - 1]) / span, 0.0, 1.0)
        return interpolate(poses[right - 1], poses[right], fraction)
