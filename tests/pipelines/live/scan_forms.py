"""One sweep as the messages of different drivers."""

from array import array
from typing import Any

import numpy as np


def as_cloud(scan: Any) -> Any:
    """A LaserScan as the PointCloud2 of a planar sensor that gives each point its time."""
    from sensor_msgs.msg import PointCloud2, PointField

    ranges = np.array(scan.ranges)
    is_return = np.isfinite(ranges) & (ranges < scan.range_max)
    beams = np.flatnonzero(is_return)
    bearings = scan.angle_min + scan.angle_increment * beams
    points = np.zeros((len(beams), 4), dtype="<f4")
    points[:, 0] = ranges[beams] * np.cos(bearings)
    points[:, 1] = ranges[beams] * np.sin(bearings)
    points[:, 3] = scan.time_increment * beams
    return PointCloud2(
        header=scan.header,
        height=1,
        width=len(points),
        fields=[
            PointField(name=name, offset=4 * i, datatype=PointField.FLOAT32, count=1)
            for i, name in enumerate(("x", "y", "z", "time"))
        ],
        point_step=16,
        row_step=16 * len(points),
        data=array("B", points.tobytes()),
        is_dense=True,
    )


def as_echoes(scan: Any) -> Any:
    """A LaserScan as a MultiEchoLaserScan, with a second echo half a metre behind each first one."""
    from sensor_msgs.msg import LaserEcho, MultiEchoLaserScan

    echoes = [LaserEcho(echoes=[r, r + 0.5] if np.isfinite(r) else []) for r in scan.ranges]
    names = ("angle_min", "angle_max", "angle_increment", "time_increment", "scan_time")
    fields = {name: getattr(scan, name) for name in (*names, "range_min", "range_max")}
    return MultiEchoLaserScan(header=scan.header, ranges=echoes, **fields)
