"""How much the steps from keyframe to keyframe may err, by the constraints along the path."""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.graph_edges import GraphEdges


def step_variances(edges: GraphEdges, first: int, end: int) -> NDArray[np.float64]:
    """(N, 2) square metres of place and square radians of turn that the steps to keyframes from ``first`` to
    before ``end`` may err.

    A constraint over several steps says of each its share. Were the errors of all of them independent, those
    that span the same steps would say as many times more; but they match the same scans, and err alike.
    """
    steps = np.where(edges.are("loop_closure"), -1, edges.ends[:, 1] - first)
    counted = (steps >= 0) & (steps < end - first)
    spans = (edges.ends[counted, 1] - edges.ends[counted, 0]).astype(np.float64)
    covariances = np.linalg.inv(edges.information[counted])
    variances = np.column_stack([covariances[:, 0, 0] + covariances[:, 1, 1], covariances[:, 2, 2]])
    worth = np.zeros((end - first, 2))
    np.add.at(worth, steps[counted], spans[:, None] / variances)
    tied = worth[:, 0] > 0.0  # all but the first keyframe of a drive
    worth[~tied] = np.inf
    return 1.0 / worth
