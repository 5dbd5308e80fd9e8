"""What the filter says of the car's pose."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from maps.se2 import Pose, mean_angle, wrap_angle

_CLUSTER_CELL = 0.5
_CLUSTER_RADIUS = 1.0
"""Metres."""


@dataclass(frozen=True, eq=False)
class PoseEstimate:
    """The pose of the dominant cluster of particles."""

    stamp: int
    """Nanoseconds: of the scan, or the time to which odometry carried the estimate."""
    map_from_base: Pose
    covariance: NDArray[np.float64]
    """(3, 3) of x, y (m) and yaw (rad) in the map frame, within the cluster."""
    cluster_weight: float
    """Share of the probability that lies in the cluster, 0 to 1."""
    effective_sample_size: float
    particle_count: int
    is_start: bool
    """Whether the pose was searched anew and does not continue the one before."""
    lost_probability: float
    """How likely the car is elsewhere, 0 to 1."""


def dominant_cluster(map_from_base: Pose, weights: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(N,) which particles belong to the heaviest place: within a metre of it."""
    positions = map_from_base[:, :2]
    low = positions.min(axis=0)
    extent = positions.max(axis=0) - low
    if np.all(extent < _CLUSTER_RADIUS):
        return np.ones(len(positions), dtype=np.bool_)
    columns, rows = np.floor((positions - low) / _CLUSTER_CELL).astype(np.int64).T
    place = rows * (columns.max() + 1) + columns
    _, place = np.unique(place, return_inverse=True)
    here = place == np.argmax(np.bincount(place, weights))
    center = np.average(positions[here], axis=0, weights=weights[here])
    near: NDArray[np.bool_] = np.hypot(*(positions - center).T) < _CLUSTER_RADIUS
    return near


def mean_and_covariance(
    map_from_base: Pose, weights: NDArray[np.float64]
) -> tuple[Pose, NDArray[np.float64]]:
    """Weighted mean (3,), circular in yaw, and covariance (3, 3) of particles (N, 3)."""
    weights = weights / weights.sum()
    mean = np.append(weights @ map_from_base[:, :2], mean_angle(map_from_base[:, 2], weights))
    deviations = map_from_base - mean
    deviations[:, 2] = wrap_angle(deviations[:, 2])
    covariance: NDArray[np.float64] = (deviations * weights[:, None]).T @ deviations
    return mean, covariance
