"""The samples of odometry and gyroscope, and what they say of the motion between two stamps."""

from dataclasses import dataclass
from math import isfinite, nan
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.geometry.se2_kernels import step_between
from racecar.sensors.motion.frozen_odometry import FrozenOdometry
from racecar.sensors.motion.gyro_buffer import GyroBuffer, GyroReading, turn_between
from racecar.sensors.motion.odometry_buffer import STALE_AFTER, Extrapolation, OdometryBuffer
from racecar.sensors.odometry import Odometry
from racecar.sensors.yaw_rate import YawRate

_RESTART = 1_000_000_000
"""By judgement: nanoseconds by which a clock must go back to count as set anew; by less, messages came out of
order."""
_EXTRAPOLATION = Extrapolation(100_000_000, speed_over=0, widest_gap=STALE_AFTER)
"""By judgement: of odometry: at the speed between its last two samples, while the next is on its way, for a
few periods of usual odometry (50 Hz)."""


@dataclass(frozen=True, eq=False)
class MeasuredMotion:
    """The motion between two stamps."""

    seconds: float
    """inf where the clock was set back, so that the time is unknown."""
    by_wheels: Pose | None = None
    """(3,) as odometry has it; None where it does not say."""
    by_gyro: float = nan
    """Radians as the gyroscope has them, NaN where it does not say."""


@dataclass(frozen=True, eq=False)
class OdometryReading:
    """What odometry and gyroscope have summed up until a stamp; only differences mean something."""

    stamp: int
    series: int
    """Number of the uninterrupted series of odometry."""
    odom_from_base: Pose | None
    by_gyro: GyroReading | None

    def motion_to(self, other: "OdometryReading") -> MeasuredMotion:
        """From this stamp to that of another reading."""
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
    """Any thread may add samples and ask at any time."""

    def __init__(self) -> None:
        self.frozen = FrozenOdometry()
        """When the odometry repeated a pose while the car moved on."""
        self._lock = Lock()
        self._series = 0
        self._odometry = OdometryBuffer(extrapolation=_EXTRAPOLATION)
        self._gyro = GyroBuffer()

    def add_odometry(self, odometry: Odometry) -> None:
        """Take a sample; one that is not finite or comes out of order is left out.

        Where its clock is set back or its poses jump, odometry begins anew.
        """
        if not isfinite(sum(odometry.odom_from_base.tolist())):
            return
        with self._lock:
            is_anew = is_set_back(self._odometry.latest_stamp, odometry.stamp)
            if self.frozen.thaws_with(odometry) or is_anew or self._odometry.jumps_to(odometry):
                self._odometry = OdometryBuffer(extrapolation=_EXTRAPOLATION)
                self._series += 1
            self._odometry.add(odometry)

    def add_yaw_rate(self, yaw_rate: YawRate) -> None:
        """Take a sample of the gyroscope; one that is no number or comes out of order is left out."""
        with self._lock:
            if is_set_back(self._gyro.latest_stamp, yaw_rate.stamp):
                self._gyro.start_anew()
            self._gyro.add(yaw_rate)

    def reading_at(self, stamp: int) -> OdometryReading:
        """At a stamp, or as near to it as samples come."""
        with self._lock:
            is_known = self._odometry.covers(stamp) and not self.frozen.is_frozen_at(stamp)
            odom_from_base = self._odometry.pose_at([stamp])[0] if is_known else None
            return OdometryReading(stamp, self._series, odom_from_base, self._gyro.reading_at(stamp))

    def poses_at(self, stamps: NDArray[np.int64]) -> Pose:
        """``odom_from_base`` (N, 3) at stamps (N,); past the latest sample, its speed lasts for a little.

        Raises LookupError while there is no odometry.
        """
        with self._lock:
            return self._odometry.pose_at(stamps)

    def gyro_turns(self, since: GyroReading | None, stamps: NDArray[np.int64]) -> NDArray[np.float64]:
        """(N,) radians from a reading to stamps (N,), as measured; NaN where that is not known."""
        with self._lock:
            if since is None or since.series != self._gyro.series:
                return np.full(len(stamps), nan)
            return self._gyro.angles_at(stamps) - since.angle

    def repeats(self, stamp: int) -> bool:
        """Whether the odometry says that the car stands, by repeating one pose to the last bit."""
        with self._lock:
            return not self.frozen.is_frozen_at(stamp) and self._odometry.repeats_since(stamp) is not None

    def leave_out_odometry(self, stamp: int) -> None:
        """The pose that the odometry repeats at a stamp is no motion, until it goes on."""
        with self._lock:
            begin = self._odometry.repeats_since(stamp)
            if begin is not None:
                self.frozen.freeze(begin, self._odometry.latest_pose)


def is_set_back(latest: int | None, stamp: int) -> bool:
    """Whether a clock was set back before a stamp, so that this is not just out of order."""
    return latest is not None and latest - stamp > _RESTART
