"""How far one keyframe may be off as seen from another, by the curvature of the solved pose graph.

The inverse of the graph's Hessian is the covariance of all poses. Of the few keyframes that are asked about,
columns of it come from a sparse factorization (Kaess and Dellaert, "Covariance recovery from a square root
information matrix for data association", Robotics and Autonomous Systems 57, 2009).
"""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.linalg import splu

from racecar.mapping.graph.graph_edges import GraphEdges
from racecar.maps.geometry.se2 import Pose, adjoint, between

_LOOSE = 0.5
"""Metres and radians that a step may err where nothing measured it: somewhat more than the step by which
keyframes are due. By judgement; it also keeps the equations solvable."""
_AT_ONCE = 64
"""Columns that are solved for at once, so that of a long drive they take some megabytes."""
_WORKERS = 2
"""Threads, since the solver works without the interpreter's lock and the computers of small cars have few
cores."""


class GraphUncertainty:
    """Of a graph that was solved to (K, 3); the first keyframe is held."""

    def __init__(self, edges: GraphEdges, poses: Pose) -> None:
        self._poses = poses
        self._factor = splu(
            _hessian(edges, poses).tocsc()[3:, 3:],
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )

    def spreads(self, pairs: NDArray[np.int64]) -> NDArray[np.float64]:
        """(P,) standard deviation in metres of the place of the second keyframes of pairs (P, 2), as seen
        from the first ones."""
        nodes, of_pairs = np.unique(pairs, return_inverse=True)
        first, second = of_pairs.reshape(-1, 2).T
        covariance = self._covariance(nodes)
        moved = moved_by_first(self._poses, pairs)
        across = moved @ covariance[first, :, second, :]
        variances = (
            covariance[second, :, second, :]
            + moved @ covariance[first, :, first, :] @ moved.transpose(0, 2, 1)
            + across
            + across.transpose(0, 2, 1)
        )
        found: NDArray[np.float64] = np.sqrt(np.maximum(variances[:, 0, 0] + variances[:, 1, 1], 0.0))
        return found

    def shifts(self, pull: NDArray[np.float64], pairs: NDArray[np.int64]) -> NDArray[np.float64]:
        """(P,) metres by which the second keyframes of pairs (P, 2) move, as seen from the first ones, where
        constraints pull keyframes by (K, 3), information times error, in their tangent frames."""
        motion = np.zeros((len(self._poses), 3))
        motion[1:] = self._factor.solve(pull[1:].ravel()).reshape(-1, 3)
        first, second = pairs.T
        apart = motion[second] + (moved_by_first(self._poses, pairs) @ motion[first][:, :, None])[:, :, 0]
        return np.asarray(np.hypot(apart[:, 0], apart[:, 1]))

    def _covariance(self, nodes: NDArray[np.int64]) -> NDArray[np.float64]:
        """(N, 3, N, 3) of some keyframes (N,), in their tangent frames."""
        size = 3 * len(self._poses)
        columns = (3 * nodes[:, None] + np.arange(3)).ravel()
        covariance = np.zeros((len(columns), len(columns)))

        def solve(start: int) -> None:
            asked = columns[start : start + _AT_ONCE]
            unit = np.zeros((size, len(asked)))
            unit[asked, np.arange(len(asked))] = 1.0
            solved = np.zeros_like(unit)
            solved[3:] = self._factor.solve(unit[3:])
            covariance[:, start : start + _AT_ONCE] = solved[columns]

        with ThreadPoolExecutor(_WORKERS) as pool:
            list(pool.map(solve, range(0, len(columns), _AT_ONCE)))
        return covariance.reshape(len(nodes), 3, len(nodes), 3)


def moved_by_first(poses: Pose, pairs: NDArray[np.int64]) -> NDArray[np.float64]:
    """(P, 3, 3) how motions of the first keyframes of pairs (P, 2) move the second ones as seen from them,
    each in its own frame."""
    return -adjoint(between(poses[pairs[:, 1]], poses[pairs[:, 0]]))


def _hessian(edges: GraphEdges, poses: Pose) -> "coo_array":
    """(3K, 3K) of the keyframes, each moving in its own frame."""
    # Errors are in the tangent frame of the second keyframe.
    first = np.arange(len(poses) - 1)
    steps = np.column_stack([first, first + 1])
    loose = np.broadcast_to(np.eye(3) / _LOOSE**2, (len(steps), 3, 3))
    ends = np.concatenate([edges.ends, steps])
    left = moved_by_first(poses, ends)
    information = np.concatenate([edges.information, loose])
    weighted = left.transpose(0, 2, 1) @ information
    blocks = np.concatenate([weighted @ left, weighted, weighted.transpose(0, 2, 1), information])
    rows = np.concatenate([ends[:, 0], ends[:, 0], ends[:, 1], ends[:, 1]])
    columns = np.concatenate([ends[:, 0], ends[:, 1], ends[:, 0], ends[:, 1]])
    axes = np.arange(3)
    at = (
        np.broadcast_to(3 * rows[:, None, None] + axes[:, None], blocks.shape).ravel(),
        np.broadcast_to(3 * columns[:, None, None] + axes, blocks.shape).ravel(),
    )
    return coo_array((blocks.ravel(), at), shape=(3 * len(poses), 3 * len(poses)))
