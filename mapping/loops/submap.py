"""Submaps: a few metres of keyframes about a middle one, taken as rigid."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.loops.config import SubmapConfig
from racecar.mapping.matching.scan_store import ScanStore
from racecar.maps.geometry.se2 import Pose, between, transform_points

_CELLS_PER_ROW = 1_000_003
"""In the numbering of cells: far more than a submap is wide, so that each cell has a number of its own."""


@dataclass(frozen=True)
class Submap:
    """Keyframes ``first`` to ``last`` (inclusive) about keyframe ``middle``, whose frame is the submap's."""

    index: int
    """Its number among the submaps of the path; -1 of one beside them."""
    first: int
    middle: int
    last: int

    @property
    def keyframes(self) -> NDArray[np.int64]:
        """(M,) indices."""
        return np.arange(self.first, self.last + 1)

    def is_whole(self, store: ScanStore) -> bool:
        """Are the scans of all its keyframes kept?"""
        return bool(store.is_kept[self.first : self.last + 1].all())

    def poses(self, map_from_keyframe: Pose) -> Pose:
        """(M, 3) poses of the keyframes in the submap's frame."""
        return between(map_from_keyframe[self.middle], map_from_keyframe[self.keyframes])

    def points(self, store: ScanStore, map_from_keyframe: Pose, config: SubmapConfig) -> NDArray[np.float64]:
        """(N, 2) points in the submap's frame, thinned to one per cell."""
        poses = self.poses(map_from_keyframe)
        clouds = [
            transform_points(pose, store.points_of(int(k)))
            for pose, k in zip(poses, self.keyframes, strict=True)
        ]
        points: NDArray[np.float64] = np.concatenate(clouds)
        cells = np.floor(points / config.point_spacing).astype(np.int64)
        _, index = np.unique(cells[:, 0] * _CELLS_PER_ROW + cells[:, 1], return_index=True)
        thinned: NDArray[np.float64] = points[np.sort(index)]
        return thinned

    def sample(
        self, store: ScanStore, map_from_keyframe: Pose, most: int, config: SubmapConfig
    ) -> NDArray[np.float64] | None:
        """About ``most`` of the points near the middle, to search with; None when there are too few."""
        points = self.points(store, map_from_keyframe, config)
        points = points[np.abs(points).max(axis=1) < config.sample_radius]
        return None if len(points) < config.min_sample else points[:: max(1, len(points) // most)]
