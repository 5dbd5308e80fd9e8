"""Odometry and gyroscope samples, and the motion they measure between two stamps."""

from dataclasses import dataclass
from math import isfinite, nan
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.geometry.se2_kernels import step_between
from racecar.sensors.motion.frozen_odometry import FrozenOdometry
from racecar.sensors.motion.gyro_buffer import GyroBuffer, GyroReading, turn_between
from racecar.sensors.motion.odometry_buffer import STAND_STILL, Extrapolation, OdometryBuffer
from racecar.sensors.odometry import Odometry
from racecar.sensors.yaw_rate import YawRate

_RESTART = 1_000_000_000
"""Nanoseconds backwards above which a clock was set back; below, messages are out of order. Chosen by
judgement."""


@dataclass(frozen=True, eq=False)
class MeasuredMotion:
    """The motion between two stamps."""

    seconds: float
    """inf if the clock was set back, so that the time is unknown."""
    by_wheels: Pose | None = None
    """(3,) by odometry; None if it did not measure it."""
    by_gyro: float = nan
    """Radians by the gyroscope; NaN if it did not measure them."""


@dataclass(frozen=True, eq=False)
class OdometryReading:
    """Odometry and gyroscope angle integrated until a stamp; only differences are meaningful."""

    stamp: int
    series: int
    """Number of the uninterrupted odometry series."""
    odom_from_base: Pose | None
    by_gyro: GyroReading | None

    def motion_to(self, other: "OdometryReading") -> MeasuredMotion:
        """The motion from this stamp to that of another reading."""
        step = None
        if (
            self.odom_from_base is not None
            and other.odom_from_base is not None
            and self.series == other.series
        ):
            step = step_between(self.odom_from_base, other.odom_from_base)
        seconds = (other.stamp - self.stamp) * 1e-9
        return MeasuredMotion(seconds, step, turn_between(self.by_gyro, other.by_gyro))


class MotionSamples:
    """Samples of both sensors; any thread may add to or read from it at any time."""

    def __init__(self, lag: int = 0, extrapolation: Extrapolation = STAND_STILL) -> None:
        """``lag``: nanoseconds by which odometry samples are stamped late; ``extrapolation``: how the car
        moves past the last one."""
        self.frozen = FrozenOdometry()
        """The times at which odometry repeated a pose while the car moved."""
        self.odometry = OdometryBuffer(lag=lag, extrapolation=extrapolation)
        """The latest series."""
        self.gyro = GyroBuffer()
        self._series = 0
        self._lock = Lock()

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "_lock"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state, _lock=Lock())

    def add_odometry(self, odometry: Odometry) -> bool:
        """Add a sample; one that is not finite or out of order is ignored.

        Odometry restarts if its clock is set back or its poses jump; returns whether it did.
        """
        if not isfinite(sum(odometry.odom_from_base.tolist())):
            return False
        with self._lock:
            latest = self.odometry.latest_stamp
            begins_anew = (
                self.frozen.thaws_with(odometry)
                or is_set_back(latest, odometry.stamp)
                or self.odometry.jumps_to(odometry)
            )
            if begins_anew:
                self.odometry = OdometryBuffer(
                    lag=self.odometry.lag, extrapolation=self.odometry.extrapolation
                )
                self._series += 1
            self.odometry.add(odometry)
            return begins_anew

    def add_yaw_rate(self, yaw_rate: YawRate) -> None:
        """Add a gyroscope sample; one that is not finite or out of order is ignored."""
        with self._lock:
            if is_set_back(self.gyro.latest_stamp, yaw_rate.stamp):
                self.gyro.start_anew()
            self.gyro.add(yaw_rate)

    def reading_at(self, stamp: int) -> OdometryReading:
        """The reading at a stamp, or as near to it as there are samples."""
        with self._lock:
            is_known = not self._is_frozen_at(stamp) and self.odometry.covers(stamp)
            odom_from_base = self.odometry.pose_at([stamp])[0] if is_known else None
            return OdometryReading(stamp, self._series, odom_from_base, self.gyro.reading_at(stamp))

    def poses_at(self, stamps: NDArray[np.int64]) -> Pose:
        """``odom_from_base`` (N, 3) at stamps (N,); past the latest sample, its speed is held briefly.

        Raises LookupError while there is no odometry.
        """
        with self._lock:
            return self.odometry.pose_at(stamps)

    def gyro_turns(self, since: GyroReading | None, stamps: NDArray[np.int64]) -> NDArray[np.float64]:
        """(N,) radians from a reading to stamps (N,), as measured; NaN if unknown."""
        with self._lock:
            if since is None or since.series != self.gyro.series:
                return np.full(len(stamps), nan)
            return self.gyro.angles_at(stamps) - since.angle

    def repeats(self, stamp: int) -> bool:
        """Whether the odometry reports that the car stands, by repeating the exact same pose."""
        return not self._is_frozen_at(stamp) and self.repeats_since(stamp) is not None

    def repeats_since(self, stamp: int, *, heading_only: bool = False) -> int | None:
        """See `OdometryBuffer.repeats_since`."""
        with self._lock:
            return self.odometry.repeats_since(stamp, heading_only=heading_only)

    def leave_out_odometry(self, begin: int | None, *, heading_only: bool = False) -> None:
        """Ignore the pose, or heading, that the odometry has repeated since a stamp, until it changes."""
        if begin is None:
            return
        with self._lock:
            unless = np.array([nan, nan, 0.0]) if heading_only else np.zeros(3)
            self.frozen.freeze(begin, self.odometry.latest_pose + unless)

    def _is_frozen_at(self, stamp: int) -> bool:
        return self.frozen.is_frozen_at(stamp + self.odometry.lag)


def is_set_back(latest: int | None, stamp: int) -> bool:
    """Whether a stamp shows that the clock was set back, rather than a message out of order."""
    return latest is not None and latest - stamp > _RESTART
