"""The final optimization of a drive: all pairs of keyframes matched once more, and the whole graph solved."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.graph.pose_graph import PoseGraph
from racecar.mapping.keyframes.config import KeyframeConfig
from racecar.mapping.keyframes.constraints import constrain, pairs_along_path
from racecar.mapping.keyframes.first_pass import pairs_with_first_pass
from racecar.mapping.matching.scan_store import ScanStore
from racecar.maps.geometry.se2 import Pose


def matched_again(
    graph: PoseGraph,
    by_wheels: Iterable[Constraint],
    poses: Pose,
    store: ScanStore,
    config: KeyframeConfig,
    are_misled: NDArray[np.bool_],
    *,
    with_first_pass: bool,
) -> PoseGraph:
    """A graph whose scan matches begin at the poses (K, 3) of now, also, where asked for, with those of the
    first pass through each place.

    What wheels measured is given anew; loop closures stay. Over steps in which matches ``are_misled``
    (K - 1,) only the wheels tell. A keyframe that nothing ties now would be free to
    go anywhere; what has held it so far still does. So do matches of scans that were trimmed and cannot be
    matched any more.
    """
    is_kept = store.is_kept
    pairs = pairs_along_path(range(len(is_kept)), config.constraints)
    misled_before = np.concatenate([[0], np.cumsum(are_misled)])
    pairs = pairs[is_kept[pairs].all(axis=1) & (misled_before[pairs[:, 0]] == misled_before[pairs[:, 1]])]
    constraints = [*constrain(pairs, poses, store, config.constraints), *by_wheels]
    tied = {constraint.to_keyframe for constraint in constraints}
    for c in graph.constraints:
        if c.kind == "loop_closure" or c.to_keyframe not in tied or _is_trimmed_match(c, is_kept):
            constraints.append(c)
    if with_first_pass:
        passes = pairs_with_first_pass(poses, is_kept, config.revisits)
        constraints += constrain(passes, poses, store, config.constraints)
    return PoseGraph(graph.config, constraints)


def _is_trimmed_match(c: Constraint, is_kept: NDArray[np.bool_]) -> bool:
    return c.kind == "scan_matching" and not is_kept[[c.from_keyframe, c.to_keyframe]].all()
