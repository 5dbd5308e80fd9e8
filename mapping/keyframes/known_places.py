"""Places that the car has passed often enough: what a later pass sees there need not be kept.

So a drive takes memory for the places there are and not for the hours it lasts. Kretzschmar and Stachniss,
"Information-theoretic compression of pose graphs for laser-based SLAM", IJRR 2012, choose by how much a scan
tells of the map; here all that face alike within two metres count the same.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.keyframes.first_pass import SAME_PASS, near_and_alike
from racecar.mapping.keyframes.keyframe_tracking import constrain
from racecar.mapping.loops.loop_closure import LoopCloser
from racecar.mapping.loops.submap_matching import nearest_pairs
from racecar.mapping.matching.scan_store import ScanStore
from racecar.mapping.matching.see_through import see_through
from racecar.maps.geometry.se2 import IDENTITY, Pose

ALL_HELD = 1500
"""Keyframes, up to which none is given up: each pass through a place makes the map a little truer."""
_ENOUGH = 6
"""Keyframes of earlier passes: one pass or so."""
_SURELY_NEAR = 20.0
"""Metres of doubt between the passes: loop closures tie them, and they do not only seem to meet."""
_MOST_OF_IT = 0.6


def ties_to_known(
    candidates: NDArray[np.int64], map_from_keyframe: Pose, loops: LoopCloser
) -> list[Constraint]:
    """Scan matches of those ``candidates`` (C,), rising, whose place earlier keyframes show, each with the
    most alike of these. The poses (K, 3) are those of all keyframes."""
    pairs = _pairs_with_known(candidates, map_from_keyframe, loops)
    ties = constrain(pairs, map_from_keyframe, loops.store)
    return [tie for tie in ties if _share_shown(tie, loops.store) > _MOST_OF_IT]


def _share_shown(tie: Constraint, store: ScanStore) -> float:
    """How much of what either scan sees lies on what the other does: who stands behind a wall sees little of
    the same, however near."""
    pair = np.array([[tie.from_keyframe, tie.to_keyframe]])
    return see_through(store, pair, IDENTITY[None], tie.from_pose_to_pose[None]).coverage


def _pairs_with_known(
    candidates: NDArray[np.int64], map_from_keyframe: Pose, loops: LoopCloser
) -> NDArray[np.int64]:
    """Pairs (P, 2) of keyframes: the second is a candidate with enough earlier ones about it, the first
    the most alike of these."""
    is_held = loops.store.is_kept.copy()
    held = np.flatnonzero(is_held)
    is_sure = loops.history.graph.are_near(candidates, held, _SURELY_NEAR)
    places = map_from_keyframe[held]
    tree = cKDTree(places[:, :2])
    pairs = []
    for row, candidate in enumerate(candidates.tolist()):
        near = near_and_alike(map_from_keyframe[candidate], places, tree)
        sure = held[near[is_sure[row, near]]]
        known = sure[is_held[sure] & (sure <= candidate - SAME_PASS)]
        if is_held[candidate] and len(known) >= _ENOUGH:
            nearest = nearest_pairs(map_from_keyframe[[candidate]], map_from_keyframe[known], 1)[1]
            pairs.append((int(known[nearest[0]]), candidate))
            is_held[candidate] = False
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)
