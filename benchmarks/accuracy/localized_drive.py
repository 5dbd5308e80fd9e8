"""A drive as estimated by the localizer, compared with the truth."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.localization.localizer import Localizer
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import Pose, wrap_angle
from racecar.pipelines.bags.replay import replay
from racecar.pipelines.simulation.simulated_drive import SimulatedDrive

LOST = 0.5
"""Metres of error, or probability of being lost, above which the car counts as lost."""
_CHI_SQUARE_95_OF_3 = 7.814728
"""The 95 % quantile of the chi-square distribution with 3 degrees of freedom, which the squared Mahalanobis
distance of a Gaussian error of x, y and yaw follows."""


@dataclass(frozen=True, eq=False)
class LocalizedDrive:
    """The localizer's estimates for a drive."""

    estimates: list[PoseEstimate]
    errors: Pose
    """(S, 3) of each estimate in the map: x, y (m) and yaw (rad)."""

    @property
    def metres(self) -> NDArray[np.float64]:
        """(S,) position error of each estimate."""
        distances: NDArray[np.float64] = np.hypot(self.errors[:, 0], self.errors[:, 1])
        return distances

    @property
    def degrees(self) -> NDArray[np.float64]:
        """(S,) absolute heading error of each estimate."""
        return np.degrees(np.abs(self.errors[:, 2]))

    @property
    def is_inside(self) -> NDArray[np.bool_]:
        """(S,) whether the error lies inside the reported 95 % ellipsoid of x, y and yaw together."""
        covariances = np.array([estimate.covariance for estimate in self.estimates])
        squared = np.einsum("si,sij,sj->s", self.errors, np.linalg.inv(covariances), self.errors)
        return np.asarray(squared <= _CHI_SQUARE_95_OF_3, dtype=np.bool_)

    def segment(self, first: int, last: int) -> "LocalizedDrive":
        """The part from scan ``first`` up to, but not including, scan ``last``."""
        return LocalizedDrive(self.estimates[first:last], self.errors[first:last])


def localize_drive(localizer: Localizer, drive: SimulatedDrive) -> LocalizedDrive:
    """Feed a drive to a localizer, with or without a known start."""
    estimates = [replayed.answer for replayed in replay(drive.messages, localizer)]
    errors = np.array([estimate.map_from_base for estimate in estimates]) - drive.truth.map_from_base
    errors[:, 2] = wrap_angle(errors[:, 2])
    return LocalizedDrive(estimates, errors)
