"""The joint match of two submaps: many pairs of their scans at once, each submap rigid."""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.loops.submap import Submap
from racecar.maps.geometry.se2 import Pose, compose
from racecar.sensors.matching.match_information import match_information
from racecar.sensors.matching.scan_matching import Pairings, match
from racecar.sensors.matching.scan_store import ScanStore
from racecar.sensors.matching.see_through import see_through

_MIN_COVERAGE = 0.3
"""Of all points, the least share that lies on the surfaces that the other scans see. By judgement: what
cannot be judged speaks neither for a loop nor against it."""
_MIN_AGREEMENT = 0.9
"""The same of those that the other scans judge. Measured: 0.85 to 0.9 in rooms that look alike, above 0.93 in
nine tenths of true loops."""
_MAX_PAIRS = 40
"""Pairs of scans that are matched jointly at most, because of the time it takes; by judgement."""
_ROUGH_KERNEL_WIDTH = 0.1
"""Metres off a line at which a point weighs a quarter in the first match: the cell of the search, because
that ends up to one cell off."""
_ROUGH_EVERY = 4
"""The first match uses one pair of scans in this many, because it only has to bridge one cell."""
_PARTNER_DISTANCE = 0.2
"""Metres within which partners are searched for in the second match. By judgement: twice the cell."""
_INDEPENDENT_PAIRS = 20.0
"""Pairs of scans that a closure is worth, however many were matched, because they share their errors; by
judgement."""
_MAX_RESIDUAL = 0.04
"""Metres of weighted residual from which the scans do not fit. By judgement: as for keyframes."""


def match_submaps(
    fixed: Submap, moving: Submap, poses: Pose, guess: Pose, store: ScanStore
) -> tuple[Pose, NDArray[np.float64]] | None:
    """Match two submaps, of keyframes at ``poses`` (K, 3), from ``guess`` (3,), which is fixed_from_moving.

    Returns fixed_from_moving (3,) between the middles of both and its information (3, 3) in the tangent frame
    of the moving one. None when the scans end up off each other's lines, look through each other's surfaces,
    or see too little in common.
    """
    fixed_poses, moving_poses = fixed.poses(poses), moving.poses(poses)
    a, b = nearest_pairs(fixed_poses, compose(guess, moving_poses), _MAX_PAIRS)
    pairs = np.column_stack([fixed.keyframes[a], moving.keyframes[b]])

    def pairings(every: int) -> Pairings:
        taken = pairs[::every]
        starts = np.array([0, len(taken)])
        return Pairings(starts, taken, fixed_poses[a[::every]], moving_poses[b[::every]])

    # A wide kernel first: the search ends up to a cell off, and a narrow one would suppress the walls across
    # a corridor, which alone show the place along it.
    rough = match(guess[None], pairings(_ROUGH_EVERY), store, store, kernel_width=_ROUGH_KERNEL_WIDTH)
    result = match(rough.poses, pairings(1), store, store, initial_distance=_PARTNER_DISTANCE)
    pose, residual = result.poses[0], float(result.residual[0])
    if residual > _MAX_RESIDUAL:
        return None
    seen = see_through(store, pairs, fixed_poses[a], compose(pose, moving_poses[b]))
    if seen.agreement < _MIN_AGREEMENT or seen.coverage < _MIN_COVERAGE:
        return None
    hessian = _INDEPENDENT_PAIRS * result.hessians[0] / len(pairs)
    return pose, match_information(hessian, residual)


def nearest_pairs(first: Pose, second: Pose, most: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Indices (P,), (P,) of the pairs of poses with the most similar views: near and facing the same way."""
    apart = np.hypot(*np.moveaxis(first[:, None, :2] - second[None, :, :2], -1, 0))
    turned = np.abs(np.angle(np.exp(1j * (first[:, None, 2] - second[None, :, 2]))))
    cost = (apart + 2.0 * turned).ravel()
    order = np.argsort(cost, kind="stable")[:most]
    a, b = np.unravel_index(order, apart.shape)
    return a, b
