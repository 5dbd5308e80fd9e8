"""How far one keyframe may be off as seen from another, by the curvature of the pose graph.

The inverse of the graph's Hessian is the covariance of all poses (Kaess and Dellaert, "Covariance recovery
from a square root information matrix for data association", Robotics and Autonomous Systems 57, 2009). So
that it can be inverted as a whole, the keyframes of a long drive move in rigid groups.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.quality.graph_edges import GraphEdges
from racecar.maps.geometry.se2 import Pose, adjoint, between

_LOOSE = 0.5
"""Metres and radians that the step from one group to the next may err where nothing measured it: somewhat
more than the step by which keyframes are due. By judgement; it also keeps the equations solvable."""


@dataclass(frozen=True, eq=False)
class GraphUncertainty:
    """The covariance of a graph's keyframes, or of groups of them; the first is held."""

    nodes: NDArray[np.int64]
    """(G,) the keyframes by which the groups are known, ascending: the first of each."""
    poses: Pose
    """(G, 3) of these."""
    covariance: NDArray[np.float64]
    """(G, 3, G, 3) in the tangent frames of these."""

    @classmethod
    def of(cls, edges: GraphEdges, poses: Pose, most: int) -> "GraphUncertainty":
        """Of keyframes at (K, 3), in ``most`` groups at most."""
        nodes = np.unique(np.linspace(0, len(poses) - 1, min(most, len(poses))).astype(np.int64))
        group = np.searchsorted(nodes, np.arange(len(poses)), side="right") - 1
        hessian = _hessian(edges, poses, nodes, group)
        count = len(nodes)
        covariance = np.zeros_like(hessian)
        free = hessian[1:, :, 1:, :].reshape(3 * (count - 1), 3 * (count - 1))
        covariance[1:, :, 1:, :] = np.linalg.inv(free).reshape(count - 1, 3, count - 1, 3)
        return cls(nodes, poses[nodes], covariance)

    def spreads(self, pairs: NDArray[np.int64]) -> NDArray[np.float64]:
        """(P,) standard deviation in metres of the place of the second groups of pairs (P, 2), as seen from
        the first ones."""
        first, second = pairs.T
        moved = -adjoint(between(self.poses[second], self.poses[first]))  # how the first moves the second
        across = moved @ self.covariance[first, :, second, :]
        variances = (
            self.covariance[second, :, second, :]
            + moved @ self.covariance[first, :, first, :] @ moved.transpose(0, 2, 1)
            + across
            + across.transpose(0, 2, 1)
        )
        spreads: NDArray[np.float64] = np.sqrt(np.maximum(variances[:, 0, 0] + variances[:, 1, 1], 0.0))
        return spreads


def _hessian(
    edges: GraphEdges, poses: Pose, nodes: NDArray[np.int64], group: NDArray[np.int64]
) -> NDArray[np.float64]:
    """(G, 3, G, 3) of groups, one of which each keyframe (K,) moves with."""
    first, second = group[edges.ends].T
    counted = first != second
    # The path may bend at each of the keyframes, not only where one group meets the next.
    information = edges.information[counted] * len(nodes) / len(poses)
    first, second = first[counted], second[counted]
    seen = poses[edges.ends[counted, 1]]  # errors are in the tangent frame of the second keyframe
    by_first = -adjoint(between(seen, poses[nodes[first]]))
    by_second = adjoint(between(seen, poses[nodes[second]]))
    blocks = np.zeros((len(nodes), len(nodes), 3, 3))
    for row, left in ((first, by_first), (second, by_second)):
        weighted = left.transpose(0, 2, 1) @ information
        for column, right in ((first, by_first), (second, by_second)):
            np.add.at(blocks, (row, column), weighted @ right)
    steps = np.arange(len(nodes) - 1)
    back = -adjoint(between(poses[nodes[1:]], poses[nodes[:-1]]))
    loose = 1.0 / _LOOSE**2
    blocks[steps, steps] += loose * back.transpose(0, 2, 1) @ back
    blocks[steps, steps + 1] += loose * back.transpose(0, 2, 1)
    blocks[steps + 1, steps] += loose * back
    blocks[steps + 1, steps + 1] += loose * np.eye(3)
    return blocks.transpose(0, 2, 1, 3)
