"""Dijkstra's search that stops at the nearest goal, compiled; scipy's knows no goals."""

import heapq

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def cheapest_goal(
    first_edge: NDArray[np.int32],
    edge_target: NDArray[np.int32],
    edge_cost: NDArray[np.float64],
    start: int,
    is_goal: NDArray[np.bool_],
) -> tuple[int, NDArray[np.int32]]:
    """The goal that costs least to get to, -1 if none can be, and each node's predecessor on the way to it.

    The graph is in compressed rows: the edges of node n are first_edge[n] to first_edge[n + 1] - 1.
    """
    costs = np.full(len(is_goal), np.inf)
    predecessors = np.full(len(is_goal), -1, dtype=np.int32)
    costs[start] = 0.0
    queue = [(0.0, start)]
    while len(queue) > 0:
        cost, node = heapq.heappop(queue)
        if cost > costs[node]:
            continue
        if is_goal[node]:
            return node, predecessors
        for edge in range(first_edge[node], first_edge[node + 1]):
            target = edge_target[edge]
            reached = cost + edge_cost[edge]
            if reached < costs[target]:
                costs[target] = reached
                predecessors[target] = node
                heapq.heappush(queue, (reached, int(target)))
    return -1, predecessors
