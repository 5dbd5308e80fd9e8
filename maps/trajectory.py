"""Poses over time."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from maps.se2 import Pose


@dataclass(frozen=True, eq=False)
class Trajectory:
    """``map_from_base`` at the stamp of each scan, ascending in time."""

    stamps: NDArray[np.int64]
    """(N,) nanoseconds."""
    map_from_base: Pose
    """(N, 3)"""

    def __len__(self) -> int:
        return len(self.stamps)
