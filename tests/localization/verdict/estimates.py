"""Estimates of a drive straight ahead, made up scan by scan."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from racecar.localization.pose_estimate import PoseEstimate

RIGHT = np.array([0.25, 0.03, 0.1, 0.12])
WRONG = np.array([0.03, 0.03, 0.15, 0.3])
"""Shares of beams that agree closely, roughly, are stopped, look through, and tell the place: half of all."""


def estimate(
    seconds: float,
    x: float,
    *,
    yaw: float = 0.0,
    agreement: NDArray[np.float64] | None = RIGHT,
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
        agreement=agreement,
    )


def straight_drive(
    seconds: float, speed: float = 1.0, agreement: NDArray[np.float64] | None = RIGHT, begin: float = 0.0
) -> Iterator[PoseEstimate]:
    """Ten scans a second."""
    for k in range(round(10 * begin), round(10 * (begin + seconds))):
        yield estimate(0.1 * k, 0.1 * k * speed, agreement=agreement, is_start=k == 0)
