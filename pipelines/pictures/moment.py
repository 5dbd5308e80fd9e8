"""A scan of a drive, to be laid over the map."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose


@dataclass(frozen=True, eq=False)
class Moment:
    """A scan as the localizer saw it."""

    stamp: int
    map_from_base: Pose
    points_in_map: NDArray[np.float64]
    """(N, 2) end points of the returns."""
    share_on_wall: float
    """Share of the end points that lie on a wall; nan when there are none."""
