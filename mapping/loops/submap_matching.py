"""The joint match of two submaps: many pairs of their scans at once, each submap rigid."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.loops.config import SubmapMatchingConfig
from racecar.mapping.loops.submap import Submap
from racecar.mapping.matching.match_information import match_information
from racecar.mapping.matching.scan_matching import Pairings, match
from racecar.mapping.matching.scan_store import ScanStore
from racecar.maps.geometry.se2 import Pose, compose


@dataclass(frozen=True, eq=False)
class SubmapMatch:
    """Where a match of two submaps ended, and the scans that it rests on."""

    fixed_from_moving: Pose
    """(3,) between the middles of both."""
    information: NDArray[np.float64]
    """(3, 3) in the tangent frame of the moving one."""
    pairs: NDArray[np.int64]
    """(P, 2) keyframes of the fixed and of the moving submap."""
    fixed_poses: Pose
    """(P, 3) of the former in the frame of the fixed submap."""
    moving_poses: Pose
    """(P, 3) of the latter in the frame of the fixed submap."""


def match_submaps(
    fixed: Submap,
    moving: Submap,
    poses: Pose,
    guess: Pose,
    store: ScanStore,
    config: SubmapMatchingConfig,
) -> SubmapMatch | None:
    """Match two submaps, of keyframes at ``poses`` (K, 3), from ``guess`` (3,), which is fixed_from_moving.

    None when the scans end up off each other's lines.
    """
    fixed_poses, moving_poses = fixed.poses(poses), moving.poses(poses)
    a, b = nearest_pairs(fixed_poses, compose(guess, moving_poses), config.max_pairs)
    pairs = np.column_stack([fixed.keyframes[a], moving.keyframes[b]])

    def pairings(every: int) -> Pairings:
        taken = pairs[::every]
        starts = np.array([0, len(taken)])
        return Pairings(starts, taken, fixed_poses[a[::every]], moving_poses[b[::every]])

    # A wide kernel first: the search ends up to a cell off, and a narrow one would suppress the walls across
    # a corridor, which alone show the place along it.
    rough = match(
        guess[None], pairings(config.rough_every), store, store, kernel_width=config.rough_kernel_width
    )
    result = match(rough.poses, pairings(1), store, store, initial_distance=config.max_partner_distance)
    if result.residual[0] > config.max_residual:
        return None
    hessian = config.independent_pairs * result.hessians[0] / len(pairs)
    information = match_information(hessian, float(result.residual[0]), store.config.point_to_line)
    pose = result.poses[0]
    return SubmapMatch(pose, information, pairs, fixed_poses[a], compose(pose, moving_poses[b]))


def nearest_pairs(first: Pose, second: Pose, most: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Indices (P,), (P,) of the pairs of poses with the most similar views: near and facing the same way."""
    apart = np.hypot(*np.moveaxis(first[:, None, :2] - second[None, :, :2], -1, 0))
    turned = np.abs(np.angle(np.exp(1j * (first[:, None, 2] - second[None, :, 2]))))
    cost = (apart + 2.0 * turned).ravel()
    order = np.argsort(cost, kind="stable")[:most]
    a, b = np.unravel_index(order, apart.shape)
    return a, b
