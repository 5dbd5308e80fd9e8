"""A drive that is localized repeatedly with one thing off, and the resulting figures."""

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
"""Metres at which an error is capped, since a lost car is lost however far off it is; one such drive would
dominate all others. A pose reported as lost is just as useless and counts the same."""
_SAID_LOST = 0.9
"""Probability above which a pose is reported as lost: after a start, no scan has ruled it out yet."""


@dataclass(frozen=True)
class DriveFigures:
    """The accuracy on one drive."""

    error_m: Annotated[float, Column("error (m)", ".4f")]
    """Mean over the scans with a known true pose, each capped at one metre; scans at which the car was
    reported as lost count as that."""
    share_lost: Annotated[float, Column("lost", ".1%")]
    """Share of these scans with an error of half a metre or more, or reported as lost."""
    starts: Annotated[int, Column("starts")]
    """Number of place searches."""


@dataclass(frozen=True, eq=False)
class AblationDrive:
    """A recorded drive, and the true poses on the map used for localization."""

    grid: OccupancyGrid
    messages: Sequence[Measurement]
    truth: Trajectory
    """True poses of some or all scans."""
    start: Pose | None
    """(3,) start pose as given to the localizer; None: the whole map is searched."""

    def localized(self, localizer: Localizer) -> DriveFigures:
        """Localize the drive with a new localizer."""
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
        """(S,) metres, for the scans with a known true pose."""
        found = {estimate.stamp: estimate for estimate in estimates}
        known = [stamp in found for stamp in self.truth.stamps.tolist()]
        answers = [found[stamp] for stamp in self.truth.stamps[known].tolist()]
        off = np.array([each.map_from_base for each in answers]) - self.truth.map_from_base[known]
        metres = np.minimum(np.hypot(off[:, 0], off[:, 1]), _WORST)
        metres[np.array([each.lost_probability for each in answers]) >= _SAID_LOST] = _WORST
        return np.asarray(metres, dtype=np.float64)
