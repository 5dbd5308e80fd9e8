"""Which steps of the path loop closures span, so that more than their neighbours tells where they lead."""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.graph_edges import GraphEdges


def closed_steps(edges: GraphEdges, steps: int) -> NDArray[np.bool_]:
    """(K - 1,) of as many ``steps``, whether a loop closure leads from before to after each."""
    begins, ends = edges.ends[edges.are("loop_closure")].T
    change = np.zeros(steps + 1, dtype=np.int64)
    np.add.at(change, begins, 1)
    np.add.at(change, ends, -1)
    closed: NDArray[np.bool_] = np.cumsum(change)[:-1] > 0
    return closed
