"""Passes that come within reach of each other when a map is corrected: loops closed and scans matched between
them, as in mapping."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import Constraint, ConstraintList
from racecar.mapping.graph.pose_graph import PoseGraph
from racecar.mapping.keyframes.constraints import constrain
from racecar.mapping.keyframes.first_pass import pairs_with_first_pass
from racecar.mapping.loops.loop_closure import LoopCloser
from racecar.mapping.loops.loop_history import LoopHistory
from racecar.maps.geometry.polyline import lengths_along
from racecar.maps.geometry.se2 import Pose
from racecar.sensors.matching.scan_store import ScanStore

_APART_REACH = 10.0
"""Metres of path about moments that are not at one place in which no scans of both are matched again. Chosen
by judgement: a submap and its surroundings."""

Pairs = NDArray[np.int64]
"""(P, 2) keyframes."""


def close_loops(
    store: ScanStore, history: LoopHistory, graph: PoseGraph, poses: Pose, apart: Pairs, start: int
) -> tuple[list[Constraint], Pose]:
    """Search for each submap in earlier ones, the nearest to keyframe ``start`` first; returns the loop
    closures, and the poses (K, 3) with them. They are added to ``history`` and ``graph``; none is between
    moments that are kept ``apart``."""
    found: list[Constraint] = []
    groups, middles = history.graph.groups(), history.graph.middles()
    for query in np.argsort(np.abs(middles - start), kind="stable").tolist():
        closures = ConstraintList(LoopCloser(store, history).search(query, query, poses))
        closed = list(closures.chosen(np.flatnonzero(~_are_apart(closures.ends, apart, poses))))
        poses = graph.close(closed, poses, groups)
        found += closed
    return found, poses


def match_passes(
    store: ScanStore, is_trusted: NDArray[np.bool_], known: ConstraintList, poses: Pose, apart: Pairs
) -> Sequence[Constraint]:
    """Match the scans of neighbouring passes with keyframes at ``poses`` (K, 3), unless ``known`` constraints
    connect them, or a scan is not trusted (K,), or they are kept ``apart``."""
    pairs = pairs_with_first_pass(poses, store.is_kept & is_trusted)
    connected = set(map(tuple, known.ends.tolist()))
    is_new = np.array([tuple(pair) not in connected for pair in pairs.tolist()], dtype=np.bool_)
    return constrain(pairs[is_new & ~_are_apart(pairs, apart, poses)], poses, store)


def _are_apart(pairs: NDArray[np.integer], apart: Pairs, poses: Pose) -> NDArray[np.bool_]:
    """(P,) whether keyframe pairs (P, 2) lie about pairs (N, 2) that are kept apart."""
    path = lengths_along(poses[:, :2])
    at, ends = np.sort(path[pairs], axis=1), np.sort(path[apart], axis=1)
    are_near = np.abs(at[:, None] - ends[None]) < _APART_REACH
    return np.asarray(np.any(np.all(are_near, axis=2), axis=1))
