"""Which converter turns which message type into scans, odometry or yaw rates, in bags and live.

Another message type is a converter of its own and a line in `SCAN_CONVERTERS`, `ODOMETRY_CONVERTERS` or
`YAW_RATE_CONVERTERS`.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from racecar.pipelines.bags.converters.imu import ImuConverter, ImuSetup
from racecar.pipelines.bags.converters.laser_scans import LaserScanConverter
from racecar.pipelines.bags.converters.multi_echo import MultiEchoConverter, first_echoes
from racecar.pipelines.bags.converters.odometry import OdometryConverter
from racecar.pipelines.bags.converters.point_clouds import PointCloudConverter
from racecar.pipelines.bags.converters.scan_reading import AS_STATED, ScanReading
from racecar.pipelines.bags.converters.transform_odometry import TransformOdometryConverter
from racecar.pipelines.bags.converters.transforms import OdometryLinks, SensorPlace
from racecar.pipelines.bags.messages import (
    IMU,
    LASER_SCAN,
    MULTI_ECHO_SCAN,
    ODOMETRY,
    OLD_TRANSFORMS,
    POINT_CLOUD,
    TRANSFORMS,
    nanoseconds,
)
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan
from racecar.sensors.yaw_rate import YawRate

if TYPE_CHECKING:
    from rosbags.typesys.stores.ros2_jazzy import sensor_msgs__msg__LaserScan

T_co = TypeVar("T_co", covariant=True)


class Converter(Protocol[T_co]):
    """Turns the messages of one topic into values of the project."""

    def convert(self, message: Any, stamp: int) -> T_co | None:
        """What a message with this stamp (nanoseconds) holds; None where it holds nothing usable."""


def stamp_of(message: Any, converter: "Converter[Any] | None" = None) -> int | None:
    """The stamp of a message's own clock in nanoseconds; None where it concerns other things only."""
    if isinstance(converter, TransformOdometryConverter):
        return converter.stamp_of(message)
    return nanoseconds(message.header.stamp)


@dataclass(frozen=True, eq=False)
class ScanSetup:
    """What is known of a sensor before its messages are converted; a converter takes what it needs."""

    place: SensorPlace
    points_are_in_base: bool
    """Whether points come in the base frame rather than in the sensor's."""
    longest_sweep: float
    """Seconds; beam times that make a sweep longer are not believed."""
    heights: tuple[float, float]
    """Metres above the base frame, lowest and highest: the section of a cloud that makes the scan."""
    reading: ScanReading = AS_STATED
    """How the numbers of messages in `SINGLE_ECHOES` are meant."""

    @property
    def base_from_points(self) -> NDArray[np.float64]:
        """(4, 4)"""
        return np.eye(4) if self.points_are_in_base else self.place.base_from_sensor


SCAN_CONVERTERS: Mapping[str, Callable[[ScanSetup, Counter[str]], Converter[Scan]]] = {
    LASER_SCAN: lambda setup, counts: LaserScanConverter(
        setup.place, setup.longest_sweep, counts, setup.reading
    ),
    MULTI_ECHO_SCAN: lambda setup, counts: MultiEchoConverter(
        LaserScanConverter(setup.place, setup.longest_sweep, counts, setup.reading)
    ),
    POINT_CLOUD: lambda setup, counts: PointCloudConverter(
        setup.base_from_points, setup.place, setup.heights, counts
    ),
}
"""By message type, in the order of preference where a bag holds several; what is mended goes into counts."""


SINGLE_ECHOES: "Mapping[str, Callable[[Any], sensor_msgs__msg__LaserScan]]" = {
    LASER_SCAN: lambda message: message,
    MULTI_ECHO_SCAN: first_echoes,
}
"""By type of the messages whose numbers may be meant otherwise than they stand, what shows that."""


@dataclass(frozen=True, eq=False)
class OdometrySetup:
    """What is known of odometry before its messages are converted; a converter takes what it needs."""

    integrate_twist: bool = False
    """Whether the pose is to be integrated from the twist."""
    links: OdometryLinks | None = None
    """Of transforms, those that are the odometry."""


ODOMETRY_CONVERTERS: Mapping[str, Callable[[OdometrySetup, Counter[str]], Converter[Odometry]]] = {
    ODOMETRY: lambda setup, counts: OdometryConverter(setup.integrate_twist, counts),
}
"""By message type."""


def _of_transforms(setup: OdometrySetup, counts: Counter[str]) -> Converter[Odometry]:
    if setup.links is None:
        raise ValueError("odometry from transforms needs to know its links")
    return TransformOdometryConverter(setup.links, counts)


TRANSFORM_CONVERTERS: Mapping[str, Callable[[OdometrySetup, Counter[str]], Converter[Odometry]]] = {
    TRANSFORMS: _of_transforms,
    OLD_TRANSFORMS: _of_transforms,
}
"""The same of messages that hold odometry among other things, and are looked at where no others are."""

YAW_RATE_CONVERTERS: Mapping[str, Callable[[ImuSetup, Counter[str]], Converter[YawRate]]] = {
    IMU: ImuConverter,
}
"""By message type."""
