"""Places passed often enough: later keyframes there need not be kept.

Memory thus grows with places and not with hours. Kretzschmar and Stachniss, "Information-theoretic
compression of pose graphs for laser-based SLAM", IJRR 2012, choose by the information a scan adds to the map;
here all close keyframes that face alike count the same.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from racecar.mapping.graph.constraint import SAME_PASS, Constraint
from racecar.mapping.keyframes.constraints import constrain
from racecar.mapping.keyframes.first_pass import near_and_alike
from racecar.mapping.loops.loop_closure import LoopCloser
from racecar.mapping.loops.submap_matching import nearest_pairs
from racecar.maps.geometry.se2 import IDENTITY, Pose
from racecar.sensors.matching.scan_store import ScanStore
from racecar.sensors.matching.see_through import see_through

_KNOWN_AFTER = 6
"""Number of nearby keyframes of earlier passes from which a place is known. Chosen by judgement: as many as
one pass leaves there."""
_MAX_SPREAD = 0.1
"""Standard deviation in metres between two passes up to which matches and loop closures surely connect them;
beyond, they may only seem to meet. Chosen by judgement: slightly more than where loops are searched for."""
_MIN_COVERAGE = 0.6
"""Share of both scans' points on each other's surfaces for one to replace the other. Chosen by judgement:
from behind a wall few are."""


def matches_with_known(
    candidates: NDArray[np.int64], map_from_keyframe: Pose, loops: LoopCloser
) -> list[Constraint]:
    """Scan matches of those ``candidates`` (C,), ascending, whose place earlier keyframes show, each with the
    most similar of these. The poses (K, 3) are those of all keyframes."""
    pairs = _pairs_with_known(candidates, map_from_keyframe, loops)
    matches = constrain(pairs, map_from_keyframe, loops.store)
    return [match for match in matches if _share_shown(match, loops.store) > _MIN_COVERAGE]


def _share_shown(match: Constraint, store: ScanStore) -> float:
    """Share of both scans' points on each other's surfaces: a scan from behind a wall has few, however
    close."""
    pair = np.array([[match.from_keyframe, match.to_keyframe]])
    return see_through(store, pair, IDENTITY[None], match.from_pose_to_pose[None]).coverage


def _pairs_with_known(
    candidates: NDArray[np.int64], map_from_keyframe: Pose, loops: LoopCloser
) -> NDArray[np.int64]:
    """Pairs (P, 2) of keyframes: the second is a candidate with enough earlier ones around it, the first the
    most similar of these."""
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
