"""Poses over time."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.calls import checked
from racecar.maps.geometry.given_arrays import as_array
from racecar.maps.geometry.se2 import Pose, compose, interpolate


@checked
@dataclass(frozen=True, eq=False)
class Trajectory:
    """``map_from_base`` at the stamp of each scan, in ascending order. Raises UserError when a shape is
    wrong."""

    stamps: NDArray[np.int64]
    """(N,) nanoseconds."""
    map_from_base: Pose
    """(N, 3)"""

    def __post_init__(self) -> None:
        stamps = as_array(self.stamps, "The stamps of a trajectory, in nanoseconds,", (None,), np.int64)
        poses = as_array(self.map_from_base, "The map_from_base of a trajectory", (len(stamps), 3))
        object.__setattr__(self, "stamps", stamps)
        object.__setattr__(self, "map_from_base", poses)

    def __len__(self) -> int:
        return len(self.stamps)

    def moved(self, new_from_map: Pose) -> "Trajectory":
        """The same poses in another map frame."""
        return Trajectory(self.stamps, compose(new_from_map, self.map_from_base))

    def poses_at(self, stamps: NDArray[np.int64]) -> Pose:
        """``map_from_base`` (M, 3) at stamps (M,) in nanoseconds, interpolated linearly and held constant
        beyond both ends."""
        last = len(self) - 1
        after = np.clip(np.searchsorted(self.stamps, stamps), min(1, last), last)
        before = np.maximum(after - 1, 0)
        seconds = np.maximum(self.stamps[after] - self.stamps[before], 1)
        fraction = np.clip((stamps - self.stamps[before]) / seconds, 0.0, 1.0)
        return interpolate(self.map_from_base[before], self.map_from_base[after], fraction)
