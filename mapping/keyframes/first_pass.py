"""Match keyframes with those of the first pass through the same place.

Loop closures connect the centres of a few submaps; between them, centimetres of drift remain. Only some
keyframes are matched, and only with the first pass: if every lap is connected to the first one, solving takes
at most twice the time; if all laps are connected, it takes a hundred times as long.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from racecar.mapping.graph.constraint import SAME_PASS, ConstraintList
from racecar.maps.geometry.se2 import Pose, wrap_angle

NEAR = 2.0
"""Metres up to which keyframes of two passes are near. Chosen by judgement: the width of a corridor."""
ALIKE_TURN = 1.0
"""Radians between headings up to which two keyframes see the same. Chosen by judgement: lasers of 270 degrees
then share three quarters of their view."""
_EVERY = 3
"""One in this many keyframes is matched with the first pass. Chosen by judgement: their scans overlap for
metres, and the graph stays small."""
_TIES = 2
"""Keyframes of the first pass matched with one, at most. Chosen by judgement: one more adds little."""


def pairs_with_first_pass(map_from_keyframe: Pose, is_kept: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Pairs (P, 2) of keyframes (K, 3), in driving order, that are close and face alike: the earlier one
    belongs to the first pass there, the later one to another. Only keyframes that are kept, (K,), are
    paired."""
    chosen = np.flatnonzero(is_kept & (np.arange(len(is_kept)) % _EVERY == 0))
    poses = map_from_keyframe[chosen]
    tree = cKDTree(poses[:, :2])
    pairs = [
        (chosen[k], chosen[later])
        for later in range(len(poses))
        for k in _of_first_pass(later, chosen, poses, tree)
    ]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def are_between_passes(constraints: ConstraintList, recordings: NDArray[np.int32]) -> NDArray[np.bool_]:
    """(C,) whether a constraint connects two passes by their scans; keyframes are of ``recordings`` (K,)."""
    ends = constraints.ends
    are_apart = np.abs(ends[:, 1] - ends[:, 0]) > SAME_PASS
    are_apart |= recordings[ends[:, 0]] != recordings[ends[:, 1]]
    are: NDArray[np.bool_] = are_apart & ~constraints.are("odometry")
    return are


def _of_first_pass(later: int, keyframes: NDArray[np.int64], poses: Pose, tree: cKDTree) -> NDArray[np.int64]:
    """The nearest (L,) to one of the poses (C, 3) of ``keyframes`` (C,), of the first pass near it."""
    alike = near_and_alike(poses[later], poses, tree)
    earlier: NDArray[np.int64] = alike[keyframes[alike] < keyframes[later] - SAME_PASS]
    if len(earlier) == 0:
        return earlier
    first = earlier[keyframes[earlier] < keyframes[earlier[0]] + SAME_PASS]
    apart = np.hypot(*(poses[first, :2] - poses[later, :2]).T)
    nearest: NDArray[np.int64] = first[np.argsort(apart, kind="stable")[:_TIES]]
    return nearest


def near_and_alike(pose: Pose, poses: Pose, tree: cKDTree) -> NDArray[np.int64]:
    """Ascending indices of poses (C, 3), with positions in the tree, that are near a pose (3,) and alike."""
    near = np.array(tree.query_ball_point(pose[:2], NEAR, return_sorted=True), dtype=np.int64)
    alike: NDArray[np.int64] = near[np.abs(wrap_angle(poses[near, 2] - pose[2])) < ALIKE_TURN]
    return alike
