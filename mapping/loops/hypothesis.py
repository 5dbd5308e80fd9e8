"""A loop hypothesis: two submaps that seem to show the same place."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.loops.submap import Submap
from racecar.maps.geometry.se2 import Pose


@dataclass(eq=False)
class Hypothesis:
    """A loop closure that was found and verified, but may still be a false positive."""

    fixed: Submap
    moving: Submap
    fixed_from_moving: Pose
    """(3,) relative pose of both centres."""
    information: NDArray[np.float64]
    """(3, 3) in the tangent frame of the moving one."""
    reach: float
    """Metres of search window it is judged by: less than the window if found near its centre."""
    accepted: bool = False

    def as_constraint(self) -> Constraint:
        """The loop closure between the centre keyframes."""
        ends = self.fixed.middle, self.moving.middle
        return Constraint(*ends, self.fixed_from_moving, self.information, "loop_closure")
