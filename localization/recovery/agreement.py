"""How the beams of a scan agree with the map from a pose, and which of them tell that place from others.

The walls of a corridor agree with any corridor as wide, on this map or on a foreign one, and wherever the car
is along it. Such beams say that the car stands between two walls, but not between which; those that would not
agree a little ahead and behind as well do.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.localization.floor.free_space import FreeSpace
from racecar.localization.recovery.agreement_kernels import count_agreeing
from racecar.localization.recovery.config import LostDetectorConfig
from racecar.localization.sensor.beams import Beams
from racecar.maps.geometry.se2 import Pose


@dataclass(frozen=True, eq=False)
class Agreement:
    """Shares of all beams of a scan that agree closely, roughly, are stopped, look through."""

    shares: NDArray[np.float64]
    """(4,) that add up to 1."""
    telling: NDArray[np.float64]
    """(4,) likewise, without the beams that agree ahead and behind as well; by half those that do at one."""


def agreement_of(
    map_from_base: Pose, beams: Beams, free_space: FreeSpace, config: LostDetectorConfig
) -> Agreement | None:
    """The agreement from a pose (3,); None when there are no beams, or where the laser cannot be."""
    every = max(1, len(beams) // config.telling_beams)
    counts = count_agreeing(
        map_from_base,
        beams.base_from_laser,
        free_space.grid_in_map,
        free_space.grid.cells,
        free_space.is_open,
        beams.bearings,
        beams.ranges,
        beams.max_range,
        (config.agreement.distance, config.agreement.share, config.close),
        config.along,
        every,
    )
    total = counts[0].sum()
    if total == 0:
        return None
    asked = -(-len(beams) // every)
    return Agreement(counts[0] / total, counts[1] / asked)
