"""What is judged: a finished map, with the path and the graph that it was made of."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid


@dataclass(frozen=True, eq=False)
class FinishedMap:
    """K keyframes of all drives, those of earlier ones first."""

    session: Session
    seconds: NDArray[np.float64]
    """(K,) of each keyframe since the drive began; NaN in earlier drives."""
    map_from_base: Pose
    """(N, 3) of the base at all scans of the drive."""
    grid: OccupancyGrid

    @property
    def poses(self) -> Pose:
        """(K, 3) of the laser at the keyframes."""
        return self.session.map_from_keyframe

    @cached_property
    def path(self) -> NDArray[np.float64]:
        """(K,) metres driven up to each keyframe."""
        steps = np.hypot(*np.diff(self.poses[:, :2], axis=0).T)
        return np.concatenate([[0.0], np.cumsum(steps)])
