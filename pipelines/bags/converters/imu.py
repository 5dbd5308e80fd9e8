"""Conversion of IMU messages to yaw rates; nothing else in them is used."""

import math
from collections import Counter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from racecar.sensors.yaw_rate import YawRate

if TYPE_CHECKING:
    from rosbags.typesys.stores.ros2_jazzy import sensor_msgs__msg__Imu

_NOT_MEASURED = -1.0
"""First entry of a covariance whose quantity the IMU does not measure, as defined by sensor_msgs/Imu."""
_TURNING = 0.2
"""rad/s about another axis that a tilting car does not sustain. Chosen by judgement."""


class ImuConverter:
    """Converts messages to yaw rates and counts those it drops."""

    def __init__(self, base_from_imu: NDArray[np.float64] | None, counts: Counter[str]) -> None:
        """``base_from_imu`` (4, 4) is the IMU's place on the car; with None, where its mount is unknown, its
        z axis is used."""
        self._up = (np.eye(4) if base_from_imu is None else base_from_imu)[2, :3].tolist()
        """The base's z axis in the IMU frame."""
        self._counts = counts

    def convert(self, message: "sensor_msgs__msg__Imu", stamp: int) -> YawRate | None:
        """The yaw rate; None if the message has none."""
        rate, (x, y, z) = message.angular_velocity, self._up
        yaw_rate = x * rate.x + y * rate.y + z * rate.z
        if message.angular_velocity_covariance[0] == _NOT_MEASURED or not math.isfinite(yaw_rate):
            self._counts["invalid_yaw_rates"] += 1
            return None
        if yaw_rate == 0.0 and max(abs(rate.x), abs(rate.y), abs(rate.z)) > _TURNING:
            self._counts["turns_about_other_axes"] += 1
        return YawRate(stamp, yaw_rate)
