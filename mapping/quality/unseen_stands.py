"""Stands in which the car may have been carried without a trace.

A car that stands sees again what it saw; so does one that is carried along bare walls, its wheels standing.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.graph_edges import GraphEdges
from racecar.mapping.quality.closed_steps import closed_steps
from racecar.mapping.quality.finished_map import FinishedMap

_LEAST_STEP = 0.05
"""Metres, below which a step tells no pace, because a car that turns on the spot has none; by judgement."""


def unseen_stands(map_: FinishedMap, edges: GraphEdges, are_bare: NDArray[np.bool_]) -> NDArray[np.float64]:
    """(K - 1,) seconds that each step took beyond what it takes at the usual pace of the drive, where only
    the wheels tell that the car stood: walls at one of its ends ``are_bare`` (K,), and no loop closure spans
    it. Before its first step every car stands, and nothing is said of that."""
    steps, seconds = np.diff(map_.path), np.nan_to_num(np.diff(map_.seconds))
    tells_pace = (steps > _LEAST_STEP) & (seconds > 0.0)
    if not tells_pace.any():
        return np.zeros(len(steps))
    stood = seconds - steps / np.median(steps[tells_pace] / seconds[tells_pace])
    untold = (
        (are_bare[1:] | are_bare[:-1]) & _are_by_wheels(edges, len(steps)) & ~closed_steps(edges, len(steps))
    )
    untold[0] = False
    stands: NDArray[np.float64] = np.where(untold, np.maximum(stood, 0.0), 0.0)
    return stands


def _are_by_wheels(edges: GraphEdges, steps: int) -> NDArray[np.bool_]:
    """(K - 1,) whether wheels tell a step."""
    by_wheels = np.zeros(steps, dtype=np.bool_)
    by_wheels[edges.ends[edges.are("odometry"), 1] - 1] = True
    return by_wheels
