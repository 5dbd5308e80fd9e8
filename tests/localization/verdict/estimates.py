"""Estimates of a drive straight ahead, made up scan by scan."""

from collections.abc import Iterator

import numpy as np

from racecar.localization.pose_estimate import PoseEstimate

RIGHT, WRONG = 3.0, -4.0
"""By how much scans fit better at the estimate than elsewhere on the right map, and on a wrong one."""


def estimate(
    seconds: float,
    x: float,
    *,
    yaw: float = 0.0,
    margin: float | None = RIGHT,
    lost: float = 0.0,
    weight: float = 1.0,
    deviation: float = 0.03,
    is_start: bool = False,
) -> PoseEstimate:
    """Of a scan at some seconds of the drive."""
    variance = deviation**2 / 2.0
    return PoseEstimate(
        stamp=round(seconds * 1e9),
        map_from_base=np.array([x, 0.0, yaw]),
        covariance=np.diag([variance, variance, 1e-4]),
        cluster_weight=weight,
        effective_sample_size=500.0,
        particle_count=1000,
        is_start=is_start,
        lost_probability=lost,
        fit=0.8,
        margin=margin,
    )


def straight_drive(
    seconds: float, speed: float = 1.0, margin: float | None = RIGHT, begin: float = 0.0
) -> Iterator[PoseEstimate]:
    """Ten scans a second, of which the last completes a look at all of the map."""
    for k in range(round(10 * begin), round(10 * (begin + seconds))):
        yield estimate(0.1 * k, 0.1 * k * speed, margin=margin if k % 10 == 9 else None, is_start=k == 0)
