"""What moves with the keyframes when a map is corrected: the trajectory, and places that people named."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import Pose, between, compose, wrap_angle
from racecar.maps.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Deformation:
    """The same session before and after its keyframes moved."""

    before: Session
    after: Session

    def places(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where places (N, 2) in the map are then: each moves with the nearest keyframe."""
        nearest = np.asarray(cKDTree(self.before.map_from_keyframe[:, :2]).query(points)[1], dtype=np.int64)
        return self._moved_with(nearest, np.column_stack([points, np.zeros(len(points))]))[:, :2]

    def trajectory(self, trajectory: Trajectory) -> Trajectory:
        """That of the last recording: each pose moves with the keyframes before and after it, as their times
        are closer."""
        if not len(trajectory):
            return trajectory
        own = np.flatnonzero(self.before.times.are_of_last)
        stamps = self.before.times.stamps[own]
        after = np.searchsorted(stamps, trajectory.stamps).clip(1, max(len(stamps) - 1, 1))
        first, second = own[after - 1], own[np.minimum(after, len(own) - 1)]
        span = np.maximum(self.before.times.stamps[second] - self.before.times.stamps[first], 1)
        passed = trajectory.stamps - self.before.times.stamps[first]
        share = np.clip(passed / span, 0.0, 1.0)[:, None]
        with_first, with_second = (self._moved_with(ks, trajectory.map_from_base) for ks in (first, second))
        apart = with_second - with_first
        apart[:, 2] = wrap_angle(apart[:, 2])
        return replace(trajectory, map_from_base=with_first + share * apart)

    def _moved_with(self, keyframes: NDArray[np.int64], poses: Pose) -> Pose:
        """Poses (N, 3), each rigid with one of the keyframes (N,)."""
        seen = between(self.before.map_from_keyframe[keyframes], poses)
        return compose(self.after.map_from_keyframe[keyframes], seen)
