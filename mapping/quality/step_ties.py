"""What holds the path together at each step: how far it could break there without the scans objecting.

If all that follows a step is moved rigidly, each constraint across the step changes by that motion seen from
its second keyframe; so the information of all of them adds up, once it is carried into one frame.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.graph_edges import GraphEdges
from racecar.maps.geometry.se2 import Pose, adjoint, inverse

_SAME_PASS = 40
"""Keyframes over which constraints hold one pass together: a little over the farthest that one is tied back
along the path, because those over more of them close loops, through a chain that may bend in between."""
_NOTHING = 1e-2
"""Information of what nothing measured, in 1/m² and 1/rad²: a spread of 10 m, more than any map may err."""


@dataclass(frozen=True, eq=False)
class StepTies:
    """K - 1 steps between keyframes."""

    by_scans: NDArray[np.float64]
    """(K - 1,) metres that the rest of the path may be shifted before scans object, standard deviation in the
    direction that they hold worst."""
    by_all: NDArray[np.float64]
    """(K - 1,) the same, wheels counted too."""

    @classmethod
    def of(cls, edges: GraphEdges, poses: Pose) -> "StepTies":
        """Of a graph solved to (K, 3)."""
        is_near = edges.ends[:, 1] - edges.ends[:, 0] <= _SAME_PASS
        scans = _slack(edges, poses, is_near & edges.are("scan_matching"))
        return cls(scans, _slack(edges, poses, is_near))


def _slack(edges: GraphEdges, poses: Pose, counted: NDArray[np.bool_]) -> NDArray[np.float64]:
    ends = edges.ends[counted]
    from_map = adjoint(inverse(poses[ends[:, 1]]))
    in_map = from_map.transpose(0, 2, 1) @ edges.information[counted] @ from_map
    change = np.zeros((len(poses), 3, 3))
    np.add.at(change, ends[:, 0], in_map)
    np.add.at(change, ends[:, 1], -in_map)
    across = np.cumsum(change, axis=0)[:-1]
    to_map = adjoint(poses[1:])
    across = to_map.transpose(0, 2, 1) @ across @ to_map + _NOTHING * np.eye(3)
    # Rounding leaves a little of what does not cross any more.
    values, vectors = np.linalg.eigh((across + across.transpose(0, 2, 1)) / 2.0)
    covariance = (vectors / np.maximum(values, _NOTHING)[:, None, :]) @ vectors.transpose(0, 2, 1)
    slack: NDArray[np.float64] = np.sqrt(np.linalg.eigvalsh(covariance[:, :2, :2])[:, -1])
    return slack
