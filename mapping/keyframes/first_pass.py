"""Places that the car passed more than once: which keyframes are matched with those of the first pass there.

Loop closures tie the middles of a few submaps; what lies between keeps centimetres of the drift. Only some
keyframes are tied, and only to the first pass: a graph in which every lap hangs on the first one is solved in
twice the time at most, one in which all laps hang together takes a hundred times as long.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from racecar.maps.geometry.se2 import Pose, wrap_angle

SAME_PASS = 39
"""Keyframes along the path, over fewer of which two belong to one pass and are tied anyway. By judgement: a
little over the farthest that is tied back along the path."""
NEAR = 2.0
"""Metres within which keyframes of two passes are near each other. By judgement: the width of a corridor."""
ALIKE_TURN = 1.0
"""Radians within which two face alike, so that they see the same. By judgement: lasers of 270 degrees then
share three quarters of their view."""
_EVERY = 3
"""Of so many keyframes one is tied to the first pass. By judgement: their scans overlap for metres, and the
graph stays small."""
_TIES = 2
"""Keyframes of the first pass to which one is tied at most, by judgement: one more adds little to them."""


def pairs_with_first_pass(map_from_keyframe: Pose, is_kept: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Pairs (P, 2) of keyframes that lie near to each other and face alike, of keyframes (K, 3) in the order
    they were driven: the earlier one belongs to the first pass there, the later one to another. Only those
    that are kept, (K,), are paired."""
    chosen = np.flatnonzero(is_kept & (np.arange(len(is_kept)) % _EVERY == 0))
    poses = map_from_keyframe[chosen]
    tree = cKDTree(poses[:, :2])
    pairs = [
        (chosen[k], chosen[later])
        for later in range(len(poses))
        for k in _of_first_pass(later, chosen, poses, tree)
    ]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


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
    """Which of the poses (C, 3), whose places the tree has, lie near a pose (3,) and face alike; rising."""
    near = np.array(tree.query_ball_point(pose[:2], NEAR, return_sorted=True), dtype=np.int64)
    alike: NDArray[np.int64] = near[np.abs(wrap_angle(poses[near, 2] - pose[2])) < ALIKE_TURN]
    return alike
