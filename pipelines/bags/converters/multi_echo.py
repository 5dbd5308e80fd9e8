"""Conversion of MultiEchoLaserScan messages to scans, using the first echo of each beam."""

from collections import Counter
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from racecar.pipelines.bags.converters.laser_scans import LaserScanConverter
from racecar.pipelines.bags.converters.scan_reading import ScanSetup
from racecar.pipelines.bags.messages import LASER_SCAN, ros2_types
from racecar.sensors.scan import Scan

if TYPE_CHECKING:
    from rosbags.typesys.stores.ros2_jazzy import (
        sensor_msgs__msg__LaserScan,
        sensor_msgs__msg__MultiEchoLaserScan,
    )

_LAYOUT = (
    *("header", "angle_min", "angle_max", "angle_increment"),
    *("time_increment", "scan_time", "range_min", "range_max"),
)
"""Fields that both messages share, by definition."""


class MultiEchoConverter:
    """Reads the first echoes as a LaserScan with the same layout.

    The first echo is the nearest surface in a beam, as in the first scan of `laser_proc`, which ROS users
    split such messages with. As there, a beam without echoes carries no information, because drivers omit
    both misses and failed readings.
    """

    def __init__(self, setup: ScanSetup, counts: Counter[str]) -> None:
        self._single_echo = LaserScanConverter(setup, counts)

    def convert(self, message: "sensor_msgs__msg__MultiEchoLaserScan", stamp: int) -> Scan | None:
        """The scan; None if the message has no usable beams."""
        return self._single_echo.convert(first_echoes(message), stamp)


def first_echoes(message: "sensor_msgs__msg__MultiEchoLaserScan") -> "sensor_msgs__msg__LaserScan":
    """A LaserScan of the first echoes; NaN for beams without any."""
    firsts = [beam.echoes[0] if len(beam.echoes) else np.nan for beam in message.ranges]
    fields: dict[str, Any] = {name: getattr(message, name) for name in _LAYOUT}
    fields |= {"ranges": np.array(firsts, dtype=np.float32), "intensities": np.empty(0, np.float32)}
    scan: Any = ros2_types().types[LASER_SCAN](**fields)
    return cast("sensor_msgs__msg__LaserScan", scan)
