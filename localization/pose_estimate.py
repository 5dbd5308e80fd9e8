"""The localizer's estimate of the car's pose."""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose

DOMINANT = 0.9
"""Weight of a cluster beside which the others do not matter, since one place is then ten times as likely as
all others. By judgement."""
_LOST_FROM = 0.5
"""Probability of being elsewhere from which the car counts as lost, by definition: more likely lost than
not."""
_KNOWN_WITHIN = 0.5
"""Metres of standard deviation within which the place is known: by judgement, as long as a car."""


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
    fit: float | None = None
    """How well the scan fits the map there, 0 to 1; None without returns."""
    margin: float | None = None
    """By how much the log-likelihood of the scans was higher there than anywhere else on the map, at the end
    of a round of looking at all of it; None in between."""

    @property
    def is_lost(self) -> bool:
        """Whether the car is rather elsewhere."""
        return self.lost_probability >= _LOST_FROM

    @property
    def is_place_known(self) -> bool:
        """Whether the car is at one place, rather than elsewhere, and that place is known well."""
        return self.cluster_weight > DOMINANT and not self.is_lost and self.deviation < _KNOWN_WITHIN

    @property
    def deviation(self) -> float:
        """Metres of standard deviation of the place, over both directions."""
        return sqrt(self.covariance[0, 0] + self.covariance[1, 1])
