"""Final optimization of a drive: match all pairs of keyframes again and solve the whole graph."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.graph.pose_graph import PoseGraph
from racecar.mapping.keyframes.constraints import constrain, constraints_of, match_pairs, pairs_along_path
from racecar.mapping.keyframes.first_pass import pairs_with_first_pass
from racecar.mapping.keyframes.misled_matches import MatchesAlongPath, poses_by_wheels
from racecar.maps.geometry.se2 import Pose, between
from racecar.sensors.matching.scan_store import ScanStore


def rematched(
    graph: PoseGraph,
    by_wheels: Sequence[Constraint],
    are_refuted: NDArray[np.bool_],
    are_misled: NDArray[np.bool_],
    poses: Pose,
    store: ScanStore,
    *,
    with_first_pass: bool,
) -> tuple[PoseGraph, Pose, NDArray[np.bool_]]:
    """Match again from the current poses (K, 3), optionally also with the first pass through each place.
    Returns the new graph, the poses to solve it from, and (K - 1,) the steps with misled scan matches,
    including those already known in ``are_misled`` (K - 1,).

    Loop closures are kept. Wheel constraints are rebuilt; where they ``are_refuted`` (K - 1,), they count
    fully only if scans are misled there. Matches over such steps are kept if the wheels do not contradict
    them: most over many steps are right, and better than chained wheels. Keyframes that would lose all
    constraints keep their old ones, and so do trimmed scans, since nothing can be matched there.
    """
    is_kept = store.is_kept
    pairs = pairs_along_path(range(len(is_kept)))
    pairs = pairs[is_kept[pairs].all(axis=1)]
    found, good = match_pairs(pairs, poses, store)
    matches = constraints_of(pairs, found, good, store)
    along = MatchesAlongPath.of(matches, found.residual[good], by_wheels, len(is_kept))
    newly = along.misled_steps() & ~are_misled
    are_misled = are_misled | newly
    are_over = along.spans.are_over(are_misled)
    left_out = are_over & along.are_contradicted(~are_over)
    constraints = [match for match, is_out in zip(matches, left_out, strict=True) if not is_out]
    connected = {constraint.to_keyframe for constraint in constraints}
    for c in by_wheels:
        if are_misled[c.from_keyframe] or not are_refuted[c.from_keyframe]:
            constraints.append(c)
            connected.add(c.to_keyframe)
        elif c.to_keyframe in connected:
            constraints.append(c.loosened(poses))
    for c in graph.constraints:
        is_trimmed = c.kind == "scan_matching" and not is_kept[[c.from_keyframe, c.to_keyframe]].all()
        if c.kind == "loop_closure" or c.to_keyframe not in connected or is_trimmed:
            constraints.append(c)
    if with_first_pass:
        constraints += constrain(pairs_with_first_pass(poses, is_kept), poses, store)
    return PoseGraph(constraints), poses_by_wheels(poses, along, newly), are_misled


def mean_bend(before: Pose, after: Pose, keyframes: int) -> float:
    """Mean displacement in metres, by an optimization (K, 3) to (K, 3), of the pose ``keyframes`` later."""
    far = min(keyframes, len(before) - 1)
    shifts = between(between(before[:-far], before[far:]), between(after[:-far], after[far:]))
    return float(np.hypot(shifts[:, 0], shifts[:, 1]).mean())
