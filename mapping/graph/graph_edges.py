"""Constraints of a pose graph as arrays, with their residuals in the solution.

The stated information is scaled by the residuals: for an honest covariance, the mean squared residual of a
kind, in standard deviations, is one (Bar-Shalom, Li and Kirubarajan, "Estimation with Applications to
Tracking and Navigation", 2001, section 5.4, normalized estimation error). No constraint gets more than its
own residual allows: where the map is torn, the matches across the tear contradict it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import KINDS, ConstraintList, Kind
from racecar.maps.geometry.se2 import Pose, between


@dataclass(frozen=True, eq=False)
class GraphEdges:
    """C constraints as arrays."""

    ends: NDArray[np.int64]
    """(C, 2) keyframes that they connect."""
    measured: Pose
    """(C, 3) measured pose of the second keyframe relative to the first."""
    errors: Pose
    """(C, 3) residuals: the solved pose of the second keyframe relative to the measured one."""
    information: NDArray[np.float64]
    """(C, 3, 3) in the tangent frame of the second keyframe, scaled by the residuals."""
    kinds: NDArray[np.int8]
    """(C,) indices into `KINDS`."""

    @classmethod
    def of(cls, constraints: ConstraintList, poses: Pose) -> "GraphEdges":
        """Build from a graph with keyframes solved to (K, 3)."""
        arrays = constraints.to_arrays()
        ends, kinds = arrays["keyframes"].astype(np.int64), arrays["kinds"]
        information = arrays["information"]
        errors = between(arrays["poses"], between(poses[ends[:, 0]], poses[ends[:, 1]]))
        squared = np.einsum("ci,cij,cj->c", errors, information, errors) / 3.0
        usual = np.ones(len(kinds))
        for kind in np.unique(kinds):
            usual[kinds == kind] = np.mean(squared[kinds == kind])
        scale = 1.0 / np.maximum(np.maximum(squared, usual), 1.0)
        return cls(ends, arrays["poses"], errors, information * scale[:, None, None], kinds)

    def are(self, kind: Kind) -> NDArray[np.bool_]:
        """(C,) whether a constraint is of this kind."""
        are: NDArray[np.bool_] = self.kinds == KINDS.index(kind)
        return are

    def step_variances(self, first: int, end: int) -> NDArray[np.float64]:
        """(N, 2) variances of the steps to keyframes from ``first`` to before ``end``: square metres of
        position and square radians of heading.

        A constraint over several steps is divided equally among them. If errors were independent, constraints
        over the same steps would add up. But they match the same scans, and their errors are correlated.
        """
        steps = np.where(self.are("loop_closure"), -1, self.ends[:, 1] - first)
        counted = (steps >= 0) & (steps < end - first)
        spans = (self.ends[counted, 1] - self.ends[counted, 0]).astype(np.float64)
        covariances = np.linalg.inv(self.information[counted])
        variances = np.column_stack([covariances[:, 0, 0] + covariances[:, 1, 1], covariances[:, 2, 2]])
        information = np.zeros((end - first, 2))
        np.add.at(information, steps[counted], spans[:, None] / variances)
        is_known = information[:, 0] > 0.0  # false for the first keyframe of a drive
        information[~is_known] = np.inf
        return 1.0 / information
