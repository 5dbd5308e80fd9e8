"""A drive that is localized again and again with one thing off, and how well that went."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from benchmarks.accuracy.localized_drive import LOST
from benchmarks.harness.table import Column
from racecar.localization.localizer import Localizer
from racecar.localization.pose_estimate import PoseEstimate
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.replay import replay
from racecar.sensors.measurement import Measurement

_WORST = 1.0
"""Metres that an error counts as at most, since a car that is lost is lost however far off: one such drive
would drown what all others show. A pose that is said to be lost is of no more use, and counts as much."""
_SAID_LOST = 0.9
"""Probability of being lost from which on a pose is: after a start no scan has said yet that it is not."""


@dataclass(frozen=True)
class DriveFigures:
    """How well a drive was localized."""

    error_m: Annotated[float, Column("error (m)", ".4f")]
    """Mean over the scans whose true pose is known, none of which counts as more than a metre; those count as
    that at which the car was said to be lost."""
    share_lost: Annotated[float, Column("lost", ".1%")]
    """Of these scans, with an error of half a metre or more, or said to be lost."""
    starts: Annotated[int, Column("starts")]
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
            error_m=float(metres.mean()),
            share_lost=float(np.mean(metres >= LOST)),
            starts=sum(estimate.is_start for estimate in estimates),
        )

    def _errors(self, estimates: Sequence[PoseEstimate]) -> NDArray[np.float64]:
        """(S,) metres, of the scans whose true pose is known."""
        found = {estimate.stamp: estimate for estimate in estimates}
        known = [stamp in found for stamp in self.truth.stamps.tolist()]
        answers = [found[stamp] for stamp in self.truth.stamps[known].tolist()]
        off = np.array([each.map_from_base for each in answers]) - self.truth.map_from_base[known]
        metres = np.minimum(np.hypot(off[:, 0], off[:, 1]), _WORST)
        metres[np.array([each.lost_probability for each in answers]) >= _SAID_LOST] = _WORST
        return np.asarray(metres, dtype=np.float64)
