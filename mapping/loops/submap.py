"""Submaps: a few metres of keyframes about a middle one, taken as rigid."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.matching.scan_store import ScanStore
from racecar.maps.geometry.se2 import Pose, between, transform_points

SPACING = 2.0
"""Metres of path from one submap to the next."""
HALF_LENGTH = 3.0
"""Metres of path to each side of the middle."""

_POINT_SPACING = 0.1
_SAMPLE_RADIUS = 15.0
_MIN_SAMPLE = 50


@dataclass(frozen=True)
class Submap:
    """Keyframes ``first`` to ``last`` (inclusive) about keyframe ``middle``, whose frame is the submap's."""

    index: int
    """Its number among the submaps."""
    first: int
    middle: int
    last: int

    @property
    def keyframes(self) -> NDArray[np.int64]:
        """(M,) indices."""
        return np.arange(self.first, self.last + 1)

    def poses(self, map_from_keyframe: Pose) -> Pose:
        """(M, 3) poses of the keyframes in the submap's frame."""
        return between(map_from_keyframe[self.middle], map_from_keyframe[self.keyframes])

    def points(self, store: ScanStore, map_from_keyframe: Pose) -> NDArray[np.float64]:
        """(N, 2) points in the submap's frame, one per cell of 0.1 m."""
        poses = self.poses(map_from_keyframe)
        clouds = [
            transform_points(pose, store.points_of(int(k)))
            for pose, k in zip(poses, self.keyframes, strict=True)
        ]
        points: NDArray[np.float64] = np.concatenate(clouds)
        cells = np.floor(points / _POINT_SPACING).astype(np.int64)
        _, index = np.unique(cells[:, 0] * 1_000_003 + cells[:, 1], return_index=True)
        kept: NDArray[np.float64] = points[np.sort(index)]
        return kept

    def sample(self, store: ScanStore, map_from_keyframe: Pose, most: int) -> NDArray[np.float64] | None:
        """Some ``most`` of the points near the middle, with which to seek it; None when there are too few."""
        points = self.points(store, map_from_keyframe)
        points = points[np.abs(points).max(axis=1) < _SAMPLE_RADIUS]
        return None if len(points) < _MIN_SAMPLE else points[:: max(1, len(points) // most)]
