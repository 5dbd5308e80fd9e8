"""Which steps of the path loop closures span, so that more than their neighbours tells where they lead."""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.graph_edges import GraphEdges


def closed_steps(edges: GraphEdges, are_bare: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(K - 1,) whether a loop closure leads from before to after each step. One from or to a keyframe whose
    walls ``are_bare`` (K,) does not count: along these it is where the path had it."""
    loops = edges.ends[edges.are("loop_closure")]
    begins, ends = loops[~are_bare[loops].any(axis=1)].T
    change = np.zeros(len(are_bare), dtype=np.int64)
    np.add.at(change, begins, 1)
    np.add.at(change, ends, -1)
    closed: NDArray[np.bool_] = np.cumsum(change)[:-1] > 0
    return closed
