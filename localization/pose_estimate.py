"""The localizer's estimate of the car's pose."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose


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
    agreement: NDArray[np.float64] | None = None
    """(4,) shares of the scan's beams that agree with the map closely, roughly, are stopped before the wall,
    look through it, without those that would agree farther along a corridor as well; None without beams, and
    where the laser would be inside an obstacle."""
