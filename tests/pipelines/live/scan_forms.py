"""One sweep as the messages of different drivers."""

from typing import Any

import numpy as np

from racecar.pipelines.bags.messages import POINT_CLOUD, nanoseconds, ros2_types
from tests.pipelines.message_samples import cloud, header


def as_cloud(scan: Any) -> Any:
    """A LaserScan as the serialized PointCloud2 of a planar sensor that gives each point its time."""
    ranges = np.array(scan.ranges)
    is_return = np.isfinite(ranges) & (ranges < scan.range_max)
    beams = np.flatnonzero(is_return)
    bearings = scan.angle_min + scan.angle_increment * beams
    points = np.zeros((len(beams), 4), dtype="<f4")
    points[:, 0] = ranges[beams] * np.cos(bearings)
    points[:, 1] = ranges[beams] * np.sin(bearings)
    points[:, 3] = scan.time_increment * beams
    message = cloud(
        header(nanoseconds(scan.header.stamp), scan.header.frame_id), ("x", "y", "z", "time"), points
    )
    return bytes(ros2_types().serialize_cdr(message, POINT_CLOUD))


def as_echoes(scan: Any) -> Any:
    """A LaserScan as a MultiEchoLaserScan, with a second echo half a metre behind each first one."""
    from sensor_msgs.msg import LaserEcho, MultiEchoLaserScan

    echoes = [LaserEcho(echoes=[r, r + 0.5] if np.isfinite(r) else []) for r in scan.ranges]
    names = ("angle_min", "angle_max", "angle_increment", "time_increment", "scan_time")
    fields = {name: getattr(scan, name) for name in (*names, "range_min", "range_max")}
    return MultiEchoLaserScan(header=scan.header, ranges=echoes, **fields)
