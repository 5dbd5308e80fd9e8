"""Joint matching of two submaps: many pairs of scans at once, each submap rigid."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.loops.submap import Submap
from racecar.maps.geometry.se2 import Pose, compose
from racecar.sensors.matching.match_information import match_information
from racecar.sensors.matching.scan_matching import Pairings, match
from racecar.sensors.matching.scan_store import ScanStore
from racecar.sensors.matching.see_through import SeeThrough, see_through

_MIN_COVERAGE = 0.3
"""Minimum share of all points on surfaces of the other scans. Chosen by judgement: points that cannot be
judged are no evidence for or against a loop."""
LEAST_AGREEMENT = 0.9
"""The same among judged points. Measured: 0.85 to 0.9 in rooms that look alike, above 0.93 in nine tenths of
true loops."""
_MAX_PAIRS = 40
"""Pairs of scans matched jointly at most, because of the time it takes; chosen by judgement."""
_ROUGH_KERNEL_WIDTH = 0.1
"""Residual in metres at which a point's weight is a quarter in the first match: the cell of the search,
because that is off by up to one cell."""
_ROUGH_EVERY = 4
"""The first match uses one in this many pairs, because it only has to correct one cell."""
_PARTNER_DISTANCE = 0.2
"""Initial correspondence distance of the second match in metres. Chosen by judgement: twice the cell."""
_INDEPENDENT_PAIRS = 20.0
"""Effective number of independent pairs, however many were matched, because their errors are correlated;
chosen by judgement."""
_MAX_RESIDUAL = 0.04
"""Maximum weighted residual in metres. Chosen by judgement: as for keyframes."""


def match_submaps(
    fixed: Submap,
    moving: Submap,
    poses: Pose,
    guess: Pose,
    store: ScanStore,
    least_agreement: float,
) -> tuple[Pose, NDArray[np.float64]] | None:
    """Match two submaps with keyframes at ``poses`` (K, 3), from ``guess`` (3,), which is fixed_from_moving.

    Returns fixed_from_moving (3,) of both centres, with information (3, 3) in the tangent frame of the moving
    one. None when scans do not lie on each other's lines, see through each other's surfaces (agree on less
    than ``least_agreement`` of the judged points), or overlap too little.
    """
    aligned = align_submaps(fixed, moving, poses, guess, store)
    if aligned.residual > _MAX_RESIDUAL:
        return None
    seen = aligned.seen(store)
    if seen.agreement < least_agreement or seen.coverage < _MIN_COVERAGE:
        return None
    return aligned.fixed_from_moving, aligned.information


@dataclass(frozen=True, eq=False)
class AlignedSubmaps:
    """Two submaps where they fit each other best."""

    fixed_from_moving: Pose
    """(3,) relative pose of both centres."""
    information: NDArray[np.float64]
    """(3, 3) in the tangent frame of the moving one."""
    residual: float
    """Weighted root mean square distance of points from lines, metres."""
    pairs: NDArray[np.int64]
    """(P, 2) keyframes that were matched."""
    fixed_poses: Pose
    """(P, 3) in the frame of the fixed one's centre."""
    moving_poses: Pose
    """(P, 3) in the frame of the moving one's centre."""

    def seen(self, store: ScanStore) -> SeeThrough:
        """Points of each on surfaces of the other, or seen through by it."""
        return see_through(
            store, self.pairs, self.fixed_poses, compose(self.fixed_from_moving, self.moving_poses)
        )


def align_submaps(
    fixed: Submap, moving: Submap, poses: Pose, guess: Pose, store: ScanStore
) -> AlignedSubmaps:
    """Align two submaps with keyframes at ``poses`` (K, 3), from ``guess`` (3,), fixed_from_moving."""
    fixed_poses, moving_poses = fixed.poses(poses), moving.poses(poses)
    a, b = nearest_pairs(fixed_poses, compose(guess, moving_poses), _MAX_PAIRS)
    pairs = np.column_stack([fixed.keyframes[a], moving.keyframes[b]])

    def pairings(every: int) -> Pairings:
        taken = pairs[::every]
        starts = np.array([0, len(taken)])
        return Pairings(starts, taken, fixed_poses[a[::every]], moving_poses[b[::every]])

    # A wide kernel first: the search is off by up to a cell, and a narrow one would suppress the walls across
    # a corridor, which alone observe the position along it.
    rough = match(guess[None], pairings(_ROUGH_EVERY), store, store, kernel_width=_ROUGH_KERNEL_WIDTH)
    result = match(rough.poses, pairings(1), store, store, initial_distance=_PARTNER_DISTANCE)
    residual = float(result.residual[0])
    information = match_information(_INDEPENDENT_PAIRS * result.hessians[0] / len(pairs), residual)
    return AlignedSubmaps(result.poses[0], information, residual, pairs, fixed_poses[a], moving_poses[b])


def nearest_pairs(first: Pose, second: Pose, most: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Indices (P,), (P,) of the pairs of poses with the most similar views: close and facing alike."""
    apart = np.hypot(*np.moveaxis(first[:, None, :2] - second[None, :, :2], -1, 0))
    turned = np.abs(np.angle(np.exp(1j * (first[:, None, 2] - second[None, :, 2]))))
    cost = (apart + 2.0 * turned).ravel()
    order = np.argsort(cost, kind="stable")[:most]
    a, b = np.unravel_index(order, apart.shape)
    return a, b
