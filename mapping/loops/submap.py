"""A submap: the keyframes along a few metres of path, taken as rigid."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, between, transform_points
from racecar.sensors.matching.correlative_search import LikelihoodPyramid
from racecar.sensors.matching.scan_store import ScanStore

_POINT_SPACING = 0.1
"""Metres: cell size for downsampling to one point each, because it is that of the correlative search."""
_SAMPLE_RADIUS = 15.0
"""Metres around the centre from which points are sampled. Chosen by judgement: well within the submap that is
searched."""
_MIN_SAMPLE = 50
"""Minimum number of points of a submap for a search, because few fit anywhere."""
_CELLS_PER_ROW = 1_000_003
"""Stride of cell numbers: much wider than any submap, so that they are unique."""


@dataclass(frozen=True)
class Submap:
    """Keyframes ``first`` to ``last`` (inclusive) around keyframe ``middle``, whose frame is the submap's."""

    index: int
    """Index among the submaps of the path; -1 if it is not one of them."""
    first: int
    middle: int
    last: int

    @property
    def keyframes(self) -> NDArray[np.int64]:
        """(M,) indices."""
        return np.arange(self.first, self.last + 1)

    def is_whole(self, store: ScanStore) -> bool:
        """Whether the scans of all its keyframes are kept."""
        return bool(store.is_kept[self.first : self.last + 1].all())

    def poses(self, map_from_keyframe: Pose) -> Pose:
        """(M, 3) poses of the keyframes in the submap's frame."""
        return between(map_from_keyframe[self.middle], map_from_keyframe[self.keyframes])

    def points(self, store: ScanStore, map_from_keyframe: Pose) -> NDArray[np.float64]:
        """(N, 2) points in the submap's frame, downsampled to one per cell."""
        poses = self.poses(map_from_keyframe)
        clouds = [
            transform_points(pose, store.points_of(int(k)))
            for pose, k in zip(poses, self.keyframes, strict=True)
        ]
        points: NDArray[np.float64] = np.concatenate(clouds)
        cells = np.floor(points / _POINT_SPACING).astype(np.int64)
        _, index = np.unique(cells[:, 0] * _CELLS_PER_ROW + cells[:, 1], return_index=True)
        thinned: NDArray[np.float64] = points[np.sort(index)]
        return thinned

    def pyramid(self, store: ScanStore, map_from_keyframe: Pose, radius: float) -> LikelihoodPyramid:
        """Likelihood pyramid of the points within ``radius`` metres, to search in."""
        return LikelihoodPyramid(self.points(store, map_from_keyframe), radius)

    def sample(self, store: ScanStore, map_from_keyframe: Pose, most: int) -> NDArray[np.float64] | None:
        """About ``most`` points near the centre, to search with; None when there are too few."""
        points = self.points(store, map_from_keyframe)
        points = points[np.abs(points).max(axis=1) < _SAMPLE_RADIUS]
        return None if len(points) < _MIN_SAMPLE else points[:: max(1, len(points) // most)]
