"""Response of a solved pose graph to errors of its measurements.

Keyframes move by the inverse Hessian of the graph times the pull of the errors, information times error. If
errors are sampled from the constraints' covariances, these motions have the covariance of the map (Papandreou
and Yuille, "Perturb-and-MAP random fields", 2011).
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.linalg import splu

from racecar.mapping.graph.graph_edges import GraphEdges
from racecar.maps.geometry.se2 import Pose, adjoint, between

_LOOSE = 0.5
"""Standard deviation in metres and radians of an unmeasured step: somewhat more than the keyframe spacing.
Chosen by judgement; it also keeps the equations solvable."""
_DRAWS, _SEED = 64, 1
"""Samples for a spread right to a tenth, since it is one over the root of twice as many; and a seed."""


class GraphMotion:
    """Linear response of a graph solved to (K, 3); the first keyframe is fixed."""

    def __init__(self, edges: GraphEdges, poses: Pose) -> None:
        first = np.arange(len(poses) - 1)
        loose = np.broadcast_to(np.eye(3) / _LOOSE**2, (len(first), 3, 3))
        self._poses = poses
        self._ends = np.concatenate([edges.ends, np.column_stack([first, first + 1])])
        self._information = np.concatenate([edges.information, loose])
        # Errors are in the tangent frame of the second keyframe.
        self._by_first = _moved_by_first(poses, self._ends).transpose(0, 2, 1)
        self._factor = splu(
            self._hessian().tocsc()[3:, 3:],
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )

    def spreads(self, pairs: NDArray[np.int64]) -> NDArray[np.float64]:
        """(P,) standard deviation in metres of the second keyframe's position relative to the first, of pairs
        (P, 2)."""
        shifts = self._shifts(np.stack([self._moved(pull) for pull in self._noise()]), pairs)
        return np.asarray(np.sqrt(np.mean(shifts**2, axis=0)))

    def shifts(self, errors: NDArray[np.float64], pairs: NDArray[np.int64]) -> NDArray[np.float64]:
        """(P,) metres by which second keyframes of pairs (P, 2) move relative to the first, given constraint
        errors (C, 3) in the tangent frames of their second keyframes."""
        pull = (self._information[: len(errors)] @ errors[:, :, None])[:, :, 0]
        return self._shifts(self._moved(pull)[None], pairs).ravel()

    def _shifts(self, motions: NDArray[np.float64], pairs: NDArray[np.int64]) -> NDArray[np.float64]:
        """(N, P) metres in each of N motions (N, K, 3)."""
        first, second = pairs.T
        by_first = (_moved_by_first(self._poses, pairs) @ motions[:, first, :, None])[..., 0]
        apart = motions[:, second] + by_first
        return np.asarray(np.hypot(apart[..., 0], apart[..., 1]))

    def _noise(self) -> Iterator[NDArray[np.float64]]:
        """Samples (C, 3) of the pull of errors with the constraints' covariances; loose steps come last."""
        generator = np.random.default_rng(_SEED)
        values, vectors = np.linalg.eigh(self._information)
        root = vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :]
        for _ in range(_DRAWS):
            yield (root @ generator.standard_normal((len(root), 3, 1)))[:, :, 0]

    def _moved(self, pull: NDArray[np.float64]) -> NDArray[np.float64]:
        """(K, 3) motion of the keyframes under pulls (C, 3) on the constraints."""
        pulled = np.zeros((len(self._poses), 3))
        first, second = self._ends[: len(pull)].T
        np.add.at(pulled, second, pull)
        np.add.at(pulled, first, (self._by_first[: len(pull)] @ pull[:, :, None])[:, :, 0])
        pulled[1:] = self._factor.solve(pulled[1:].ravel()).reshape(-1, 3)
        pulled[0] = 0.0
        return pulled

    def _hessian(self) -> "coo_array":
        """(3K, 3K) Hessian with respect to each keyframe's own frame."""
        weighted = self._by_first @ self._information
        of_first, swapped = weighted @ self._by_first.transpose(0, 2, 1), weighted.transpose(0, 2, 1)
        blocks = np.concatenate([of_first, weighted, swapped, self._information])
        first, second = self._ends.T
        rows = 3 * np.concatenate([first, first, second, second])[:, None, None]
        columns = 3 * np.concatenate([first, second, first, second])[:, None, None]
        axes = np.arange(3)
        at = np.broadcast_arrays(rows + axes[:, None], columns + axes, blocks)
        size = 3 * len(self._poses)
        return coo_array((blocks.ravel(), (at[0].ravel(), at[1].ravel())), shape=(size, size))


def _moved_by_first(poses: Pose, pairs: NDArray[np.int64]) -> NDArray[np.float64]:
    """(P, 3, 3) how first keyframes of pairs (P, 2) move the second ones relative to them, each in its own
    frame."""
    return -adjoint(between(poses[pairs[:, 1]], poses[pairs[:, 0]]))
