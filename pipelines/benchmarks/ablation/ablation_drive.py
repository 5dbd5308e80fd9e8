"""A drive that is localized again and again with one thing off, and how well that went."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.localization.localizer import Localizer
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.sensing.measurement import Measurement
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.replay import replay

_LOST = 0.5
"""Metres off from which on the car counts as lost, as in `racecar benchmark accuracy`."""
_WORST = 1.0
"""Metres that an error counts as at most, since a car that is lost is lost however far off: one such drive
would drown what all others show."""


@dataclass(frozen=True)
class DriveFigures:
    """How well a drive was localized."""

    error_m: float
    """Mean over the scans whose true pose is known, none of which counts as more than a metre."""
    share_lost: float
    """Of these scans, with an error of half a metre or more."""
    starts: int
    """How often the place was searched for."""


@dataclass(frozen=True, eq=False)
class AblationDrive:
    """What a car recorded, and where it was on the map that it is looked for on."""

    grid: OccupancyGrid
    messages: Sequence[Measurement]
    truth: Trajectory
    """Of some of the scans, or all."""
    start: Pose | None
    """(3,) as it is told; None: it is looked for anywhere."""

    def localized(self, localizer: Localizer) -> DriveFigures:
        """By a new localizer."""
        if self.start is not None:
            localizer.set_pose(self.start)
        estimates = [replayed.answer for replayed in replay(self.messages, localizer)]
        metres = self._errors(estimates)
        return DriveFigures(
            error_m=float(np.minimum(metres, _WORST).mean()),
            share_lost=float(np.mean(metres >= _LOST)),
            starts=sum(estimate.is_start for estimate in estimates),
        )

    def _errors(self, estimates: Sequence[PoseEstimate]) -> NDArray[np.float64]:
        """(S,) metres, of the scans whose true pose is known."""
        found = {estimate.stamp: estimate.map_from_base for estimate in estimates}
        known = [stamp in found for stamp in self.truth.stamps.tolist()]
        poses = np.array([found[stamp] for stamp in self.truth.stamps[known].tolist()])
        off = poses[:, :2] - self.truth.map_from_base[known, :2]
        return np.asarray(np.hypot(*off.T), dtype=np.float64)
