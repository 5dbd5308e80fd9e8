"""A finished map to be judged, with its path and pose graph."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import Pose


@dataclass(frozen=True, eq=False)
class FinishedMap:
    """K keyframes of all drives, those of earlier ones first."""

    session: Session
    wheel_scale: float = 1.0
    """Learned length by scans relative to length by wheels; 1 if not learned."""
    overruled_wheels: float = 0.0
    """Share of the drive's steps in which the scans refuted the wheels."""

    @property
    def first_of_last_drive(self) -> int:
        """Index of the last drive's first keyframe."""
        drives = self.session.times.drives
        return int(np.argmax(drives == drives[-1]))

    @property
    def last_drive(self) -> "FinishedMap":
        """The last drive alone: the world may have changed between drives, and earlier ones were judged
        before."""
        first = self.first_of_last_drive
        if first == 0:
            return self
        return replace(self, session=self.session.only(np.arange(len(self.poses)) >= first))

    @property
    def poses(self) -> Pose:
        """(K, 3) laser poses of the keyframes."""
        return self.session.map_from_keyframe

    @cached_property
    def seconds(self) -> NDArray[np.float64]:
        """(K,) seconds since the begin of each keyframe's recording."""
        return self.session.times.seconds

    @cached_property
    def seconds_of_steps(self) -> NDArray[np.float64]:
        """(K - 1,) seconds from each keyframe to the next; 0 from one recording to another."""
        is_one: NDArray[np.bool_] = np.diff(self.session.times.numbers) == 0
        return np.where(is_one, np.diff(self.session.times.stamps) * 1e-9, 0.0)

    @cached_property
    def path(self) -> NDArray[np.float64]:
        """(K,) metres driven up to each keyframe; none from one recording to another."""
        return self.session.path
