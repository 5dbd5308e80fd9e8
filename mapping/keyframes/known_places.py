"""Places that the car has passed often enough: what a later pass sees there need not be kept.

So a drive takes memory for the places there are and not for the hours it lasts. Kretzschmar and Stachniss,
"Information-theoretic compression of pose graphs for laser-based SLAM", IJRR 2012, choose by how much a scan
adds to the map; here all that lie near and face alike count the same.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.keyframes.constraints import constrain
from racecar.mapping.keyframes.first_pass import SAME_PASS, near_and_alike
from racecar.mapping.loops.loop_closure import LoopCloser
from racecar.mapping.loops.submap_matching import nearest_pairs
from racecar.maps.geometry.se2 import IDENTITY, Pose
from racecar.sensors.matching.scan_store import ScanStore
from racecar.sensors.matching.see_through import see_through

_KNOWN_AFTER = 6
"""Keyframes of earlier passes near a place, from which on it is known well enough. By judgement: as many as
one pass leaves there."""
_MAX_SPREAD = 0.1
"""Metres of standard deviation between two passes, up to which matches and loop closures tie them surely;
beyond, they may only seem to meet. By judgement: a little more than where loops are looked for."""
_MIN_COVERAGE = 0.6
"""Share of what two scans see that lies on what the other sees, for one to stand for the other, by judgement:
from behind a wall little does."""


def ties_to_known(
    candidates: NDArray[np.int64], map_from_keyframe: Pose, loops: LoopCloser
) -> list[Constraint]:
    """Scan matches of those ``candidates`` (C,), rising, whose place earlier keyframes show, each with the
    most alike of these. The poses (K, 3) are those of all keyframes."""
    pairs = _pairs_with_known(candidates, map_from_keyframe, loops)
    ties = constrain(pairs, map_from_keyframe, loops.store)
    return [tie for tie in ties if _share_shown(tie, loops.store) > _MIN_COVERAGE]


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
    is_kept = loops.store.is_kept.copy()
    kept = np.flatnonzero(is_kept)
    is_sure = loops.history.graph.are_near(candidates, kept, map_from_keyframe, _MAX_SPREAD)
    places = map_from_keyframe[kept]
    tree = cKDTree(places[:, :2])
    pairs = []
    for row, candidate in enumerate(candidates.tolist()):
        near = near_and_alike(map_from_keyframe[candidate], places, tree)
        sure = kept[near[is_sure[row, near]]]
        known = sure[is_kept[sure] & (sure <= candidate - SAME_PASS)]
        if is_kept[candidate] and len(known) >= _KNOWN_AFTER:
            nearest = nearest_pairs(map_from_keyframe[[candidate]], map_from_keyframe[known], 1)[1]
            pairs.append((int(known[nearest[0]]), candidate))
            is_kept[candidate] = False
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)
