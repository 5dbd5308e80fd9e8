"""Converters by message type, for scans, odometry and yaw rates, in bags and live.

A new message type is a converter and an entry in `SCAN_CONVERTERS`, `ODOMETRY_CONVERTERS` or
`YAW_RATE_CONVERTERS`. Corrections are counted.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from racecar.pipelines.bags.converters.imu import ImuConverter
from racecar.pipelines.bags.converters.laser_scans import LaserScanConverter
from racecar.pipelines.bags.converters.multi_echo import MultiEchoConverter, first_echoes
from racecar.pipelines.bags.converters.odometry import OdometryConverter
from racecar.pipelines.bags.converters.point_clouds import PointCloudConverter
from racecar.pipelines.bags.converters.scan_reading import ScanSetup
from racecar.pipelines.bags.converters.transform_odometry import TransformOdometryConverter
from racecar.pipelines.bags.messages import (
    IMU,
    LASER_SCAN,
    MULTI_ECHO_SCAN,
    ODOMETRY,
    POINT_CLOUD,
    nanoseconds,
)
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.yaw_rate import YawRate

if TYPE_CHECKING:
    from rosbags.typesys.stores.ros2_jazzy import sensor_msgs__msg__LaserScan

T_co = TypeVar("T_co", covariant=True)


class Converter(Protocol[T_co]):
    """Converts the messages of one topic to values of the project."""

    def convert(self, message: Any, stamp: int) -> T_co | None:
        """Convert a message with this stamp (nanoseconds); None if it has nothing usable."""


def stamp_of(message: Any, converter: "Converter[Any] | None" = None) -> int | None:
    """The stamp in a message's header, in nanoseconds; None if the converter has no use for the message."""
    if isinstance(converter, TransformOdometryConverter):
        return converter.stamp_of(message)
    return nanoseconds(message.header.stamp)


SCAN_CONVERTERS: Mapping[str, Callable[[ScanSetup, Counter[str]], Converter[Scan]]] = {
    LASER_SCAN: LaserScanConverter,
    MULTI_ECHO_SCAN: MultiEchoConverter,
    POINT_CLOUD: PointCloudConverter,
}
"""By message type, in order of preference if a bag has several."""

SINGLE_ECHOES: "Mapping[str, Callable[[Any], sensor_msgs__msg__LaserScan]]" = {
    LASER_SCAN: lambda message: message,
    MULTI_ECHO_SCAN: first_echoes,
}
"""By message type whose numbers may not mean what they state: the LaserScan from which this is learned."""

ODOMETRY_CONVERTERS: Mapping[str, Callable[[bool, Counter[str]], Converter[Odometry]]] = {
    ODOMETRY: OdometryConverter
}
"""By message type; called with whether to integrate the twist instead of using the pose."""

YAW_RATE_CONVERTERS: Mapping[
    str, Callable[[NDArray[np.float64] | None, Counter[str]], Converter[YawRate]]
] = {IMU: ImuConverter}
"""By message type; called with ``base_from_imu`` (4, 4), or None if the mount is unknown."""
