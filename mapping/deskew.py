"""Correct a sweep for the car's motion while it was taken."""

import numpy as np
from numpy.typing import NDArray

from maps.odometry import OdometryBuffer
from maps.scan import Scan
from maps.se2 import compose, inverse


def deskew(scan: Scan, odometry: OdometryBuffer) -> NDArray[np.float64]:
    """End points (M, 2) of the returns in the laser frame at the scan's stamp.

    Each beam is carried from the laser's pose at its own time, by odometry. Without odometry, or when
    the sensor does not time its beams, the points are as measured.
    """
    return _carry(scan.points_in_laser(), scan.time_offsets[scan.is_return], scan, odometry)


def deskew_cloud(scan: Scan, odometry: OdometryBuffer) -> NDArray[np.float64] | None:
    """Points (N, 3) of the scan's cloud, corrected like its beams; None when it has no cloud."""
    if scan.cloud is None:
        return None
    points, offsets = scan.cloud.points, scan.cloud.time_offsets
    return _carry(points.astype(np.float64), offsets.astype(np.float64), scan, odometry)


def _carry(
    points: NDArray[np.float64], offsets: NDArray[np.float64], scan: Scan, odometry: OdometryBuffer
) -> NDArray[np.float64]:
    """Points (N, 2) or (N, 3), seen ``offsets`` (N,) seconds after the stamp, as they lie at the stamp."""
    if len(odometry) == 0 or len(points) == 0 or not np.any(offsets):
        return points
    stamps = scan.stamp + np.rint(offsets * 1e9).astype(np.int64)
    odom_from_laser = compose(odometry.pose_at(np.append(stamps, scan.stamp)), scan.base_from_laser)
    laser_from_beam = compose(inverse(odom_from_laser[-1]), odom_from_laser[:-1])
    cos, sin = np.cos(laser_from_beam[:, 2]), np.sin(laser_from_beam[:, 2])
    x = laser_from_beam[:, 0] + cos * points[:, 0] - sin * points[:, 1]
    y = laser_from_beam[:, 1] + sin * points[:, 0] + cos * points[:, 1]
    return np.column_stack([x, y, points[:, 2:]])
