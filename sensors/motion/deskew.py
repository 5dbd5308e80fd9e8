"""Corrects a sweep for the laser's motion during it."""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose, inverse
from racecar.sensors.motion.odometry_buffer import OdometryBuffer
from racecar.sensors.scan import Scan

LaserMotion: TypeAlias = Callable[[NDArray[np.float64]], Pose]
"""Pose of the laser (N, 3) at offsets (N,) in seconds after the stamp, in its own frame at the stamp."""


TurnCorrection: TypeAlias = Callable[[Pose, NDArray[np.float64], NDArray[np.int64]], Pose]
"""Corrects wheel steps (N, 3) of the base by a gyroscope; the steps take (N,) seconds and end at stamps
(N,)."""


def by_odometry(
    scan: Scan, odometry: OdometryBuffer, correction: TurnCorrection | None = None
) -> LaserMotion:
    """The motion reported by the wheels; no motion before their first sample."""
    if len(odometry) == 0:
        return by_velocity(IDENTITY)

    def laser_from_later(seconds: NDArray[np.float64]) -> Pose:
        stamps = scan.stamp + np.rint(seconds * 1e9).astype(np.int64)
        odom_from_base = odometry.pose_at(np.append(stamps, scan.stamp))
        if correction is not None:
            steps = correction(between(odom_from_base[-1], odom_from_base[:-1]), seconds, stamps)
            return compose(inverse(scan.base_from_laser), compose(steps, scan.base_from_laser))
        odom_from_laser = compose(odom_from_base, scan.base_from_laser)
        return compose(inverse(odom_from_laser[-1]), odom_from_laser[:-1])

    return laser_from_later


def by_velocity(velocity: Pose) -> LaserMotion:
    """Constant velocity (3,) in the laser's frame, metres and radians per second."""

    def laser_from_later(seconds: NDArray[np.float64]) -> Pose:
        x, y, turn = (seconds[:, None] * velocity).T
        # The chord of an arc is shorter than the arc, and deviates from its start by half the turn.
        shorter = np.sinc(0.5 * turn / np.pi)
        cos, sin = shorter * np.cos(0.5 * turn), shorter * np.sin(0.5 * turn)
        return np.column_stack([cos * x - sin * y, sin * x + cos * y, turn])

    return laser_from_later


def seen_by(mount: Pose | None, motion: LaserMotion) -> LaserMotion:
    """The motion of a laser at ``mount`` (3,) in the frame of the one whose motion is given; None for that
    laser itself."""
    if mount is None:
        return motion
    mounted = mount
    return lambda seconds: compose(compose(inverse(mounted), motion(seconds)), mounted)


def deskew(scan: Scan, motion: LaserMotion) -> NDArray[np.float64]:
    """End points (M, 2) of the returns in the laser frame at the scan's stamp.

    Each beam is transformed from the laser's pose at its own time. Without beam times the points stay as
    measured.
    """
    return _at_stamp(scan.points_in_laser(), scan.time_offsets[scan.is_return], motion)


def deskew_cloud(scan: Scan, motion: LaserMotion) -> NDArray[np.float64] | None:
    """Points (N, 3) of the scan's cloud, corrected like its beams; None if it has no cloud."""
    if scan.cloud is None:
        return None
    points, offsets = scan.cloud.points, scan.cloud.time_offsets
    return _at_stamp(points.astype(np.float64), offsets.astype(np.float64), motion)


def _at_stamp(
    points: NDArray[np.float64], offsets: NDArray[np.float64], motion: LaserMotion
) -> NDArray[np.float64]:
    """Points (N, 2) or (N, 3), seen ``offsets`` (N,) seconds after the stamp, in the frame at the stamp."""
    if len(points) == 0 or not np.any(offsets):
        return points
    laser_from_beam = motion(offsets)
    cos, sin = np.cos(laser_from_beam[:, 2]), np.sin(laser_from_beam[:, 2])
    x = laser_from_beam[:, 0] + cos * points[:, 0] - sin * points[:, 1]
    y = laser_from_beam[:, 1] + sin * points[:, 0] + cos * points[:, 1]
    return np.column_stack([x, y, points[:, 2:]])
