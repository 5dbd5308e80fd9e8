"""What moves with the keyframes when a map is corrected: the trajectory, and places that people named."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import Pose, between, compose, inverse, transform_points, wrap_angle
from racecar.maps.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Deformation:
    """The same session before and after its keyframes moved."""

    before: Session
    after: Session

    def places(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where places (N, 2) in the map are then: each moves with the nearest keyframe."""
        old, new = self.before.map_from_keyframe, self.after.map_from_keyframe
        nearest = [int(np.argmin(np.hypot(*(old[:, :2] - point).T))) for point in points]
        return np.array(
            [
                transform_points(new[k], transform_points(inverse(old[k]), point[None]))[0]
                for k, point in zip(nearest, points, strict=True)
            ]
        ).reshape(-1, 2)

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
