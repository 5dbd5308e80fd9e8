"""The estimate of the car's pose."""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose

DOMINANT = 0.9
"""Weight of a cluster that makes others irrelevant, since one place is then ten times as likely as all
others. Chosen by judgement."""
_LOST_FROM = 0.5
"""Probability of being elsewhere from which the car is lost, by definition: more likely than not."""
_KNOWN_WITHIN = 0.5
"""Standard deviation in metres of a known position. Chosen by judgement: the length of a car."""


@dataclass(frozen=True, eq=False)
class PoseEstimate:
    """The pose of the dominant cluster of particles."""

    stamp: int
    """Nanoseconds: of the scan, or to which odometry propagated the estimate."""
    map_from_base: Pose
    covariance: NDArray[np.float64]
    """(3, 3) of x, y (m) and yaw (rad) in the map frame, within the cluster."""
    cluster_weight: float
    """Probability of the cluster, 0 to 1."""
    effective_sample_size: float
    particle_count: int
    is_start: bool
    """Whether the pose comes from a new search and does not continue the last one."""
    lost_probability: float
    """Probability that the car is elsewhere, 0 to 1."""
    fit: float | None = None
    """How well the scan fits the map there, 0 to 1; None without returns."""
    margin: float | None = None
    """Difference of the scans' log-likelihood there and at the best other place on the map, at the end of a
    complete comparison; None in between."""

    @property
    def is_lost(self) -> bool:
        """Whether the car is probably elsewhere."""
        return self.lost_probability >= _LOST_FROM

    @property
    def is_place_known(self) -> bool:
        """Whether the car is probably at one well-known position."""
        return self.cluster_weight > DOMINANT and not self.is_lost and self.deviation < _KNOWN_WITHIN

    @property
    def deviation(self) -> float:
        """Standard deviation of the position in metres, over both axes."""
        return sqrt(self.covariance[0, 0] + self.covariance[1, 1])
