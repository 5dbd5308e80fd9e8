"""Motion that neither scans nor wheels observed.

A standing car sees the same again, and so does one that drives along bare walls. Wheels distinguish the two,
unless it is carried; without wheels nothing does.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.graph_edges import GraphEdges
from racecar.mapping.quality.finished_map import FinishedMap

MOST_UNSEEN = 1.5
"""Metres that a car may move unobserved: three times what a good map may err. Measured: robots that stood in
corridors would have gone 0.8 m at most, on 93 other good maps 1.1 m."""
_LEAST_STEP = 0.05
"""Metres from which a step counts for the speed, because turns on the spot have none; chosen by judgement."""


def unseen_motion(map_: FinishedMap, edges: GraphEdges, are_bare: NDArray[np.bool_]) -> NDArray[np.float64]:
    """(K - 1,) metres that the car would have driven at its median speed, in excess of the map, in steps
    whose length walls do not show: scans ``are_bare`` (K,) at either end, and no loop closure spans it. If
    the car has wheels, the first step is assumed to be standing."""
    steps, seconds = np.diff(map_.path), map_.seconds_of_steps
    shows_speed = (steps > _LEAST_STEP) & (seconds > 0.0)
    if not shows_speed.any():
        return np.zeros(len(steps))
    speed = np.median(steps[shows_speed] / seconds[shows_speed])
    are_unobserved = (are_bare[1:] | are_bare[:-1]) & ~_closed_steps(edges, are_bare)
    if (edges.ends[edges.are("odometry"), 1] == 1).any():
        are_unobserved[0] = False
    metres: NDArray[np.float64] = np.where(are_unobserved, np.maximum(speed * seconds - steps, 0.0), 0.0)
    return metres


def _closed_steps(edges: GraphEdges, are_bare: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(K - 1,) whether a loop closure spans each step, so that more than its neighbours constrain it.
    Closures at a keyframe where scans ``are_bare`` (K,) do not count: along these walls, they only confirm
    the path."""
    loops = edges.ends[edges.are("loop_closure")]
    begins, ends = loops[~are_bare[loops].any(axis=1)].T
    change = np.zeros(len(are_bare), dtype=np.int64)
    np.add.at(change, begins, 1)
    np.add.at(change, ends, -1)
    closed: NDArray[np.bool_] = np.cumsum(change)[:-1] > 0
    return closed
