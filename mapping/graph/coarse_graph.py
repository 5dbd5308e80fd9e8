"""Submaps as the nodes of a pose graph: rough, and solved quickly however long the drive was.

The keyframes nearest to the middle of a submap move as one. All that the constraints between two such groups
tell is taken together to one, by a step of Gauss-Newton from where the groups are now. Cf. Grisetti et al.,
"Hierarchical Optimization on Manifolds for Online 2D and 3D Mapping", ICRA 2010.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import Constraint, ConstraintList
from racecar.maps.geometry.se2 import Pose, between, compose, interpolate


@dataclass(frozen=True, eq=False)
class Groups:
    """Which submap each keyframe goes with."""

    middles: NDArray[np.int64]
    """(M,) the keyframes in the middle of the submaps, rising; at least one."""
    doubt: NDArray[np.float64]
    """(K,) metres driven up to each keyframe, where scans do not tie one to the last counted as many more."""

    def nearest(self) -> NDArray[np.int64]:
        """(K,) the group of each keyframe."""
        before, after, share = self._neighbours()
        return np.where(share > 0.5, after, before)

    def carry(self, map_from_keyframe: Pose, map_from_middle: Pose) -> Pose:
        """The keyframes' poses (K, 3), moved so that the middles come to lie at (M, 3).

        Between two middles the way in which one is moved goes over to that of the other.
        """
        before, after, share = self._neighbours()

        def moved_with(group: NDArray[np.int64]) -> Pose:
            middle_from_keyframe = between(map_from_keyframe[self.middles[group]], map_from_keyframe)
            return compose(map_from_middle[group], middle_from_keyframe)

        return interpolate(moved_with(before), moved_with(after), share)

    def _neighbours(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
        """The groups (K,) before and after each keyframe, and its share (K,) of the way between: 0 to 1."""
        following = np.searchsorted(self.middles, np.arange(len(self.doubt)), side="right")
        before, after = np.maximum(following - 1, 0), np.minimum(following, len(self.middles) - 1)
        start, end = self.doubt[self.middles[before]], self.doubt[self.middles[after]]
        share = (self.doubt - start) / np.maximum(end - start, 1e-9)
        return before, after, np.clip(share, 0.0, 1.0)


def between_groups(constraints: ConstraintList, map_from_keyframe: Pose, groups: Groups) -> list[Constraint]:
    """The constraints of the keyframes (K, 3) with groups in their stead.

    Loop closures connect middles and stay as they are. Scan matches are weighed by how well they fit now, as
    their Cauchy loss does, and what becomes of them is not robust any more.
    """
    group = groups.nearest()
    is_loop = constraints.are("loop_closure")
    first, second = group[constraints.to_arrays()["keyframes"]].T
    local = constraints.chosen(np.flatnonzero(~is_loop & (first != second)))
    closures = [
        replace(constraints[k], from_keyframe=int(first[k]), to_keyframe=int(second[k]))
        for k in np.flatnonzero(is_loop).tolist()
    ]
    return _taken_together(local, map_from_keyframe, group, map_from_keyframe[groups.middles]) + closures


def _taken_together(
    local: ConstraintList, map_from_keyframe: Pose, group: NDArray[np.int64], middle: Pose
) -> list[Constraint]:
    """One constraint for each pair of groups, with their middles at (M, 3), that any connect."""
    edges = local.to_arrays()
    first, second = edges["keyframes"].T
    error = between(edges["poses"], between(map_from_keyframe[first], map_from_keyframe[second]))
    information = _weighed(edges["information"], local.are("scan_matching"), error)
    # A group that moves by delta in its middle's tangent frame makes it error + jacobian delta.
    jacobian = _adjoint(between(map_from_keyframe[second], middle[group[second]]))
    weighed = jacobian.transpose(0, 2, 1) @ information
    pairs, pair = np.unique(group[first] * len(middle) + group[second], return_inverse=True)
    hessian, gradient = np.zeros((len(pairs), 3, 3)), np.zeros((len(pairs), 3, 1))
    np.add.at(hessian, pair, weighed @ jacobian)
    np.add.at(gradient, pair, weighed @ error[:, :, None])
    delta = -np.linalg.solve(hessian, gradient)[:, :, 0]
    earlier, later = np.divmod(pairs, len(middle))
    measured = compose(between(middle[earlier], middle[later]), delta)
    return [
        Constraint(a, b, pose, matrix, "odometry")
        for a, b, pose, matrix in zip(earlier.tolist(), later.tolist(), measured, hessian, strict=True)
    ]


def _weighed(
    information: NDArray[np.float64], is_robust: NDArray[np.bool_], error: Pose
) -> NDArray[np.float64]:
    """Information (N, 3, 3), less of it where a scan match, which is robust, misses by an error (N, 3)."""
    squared = (error[:, None] @ information @ error[:, :, None])[:, :, 0]
    return information / np.where(is_robust[:, None], 1.0 + squared, 1.0)[:, :, None]


def _adjoint(poses: Pose) -> NDArray[np.float64]:
    """(N, 3, 3): turns a motion in the tangent frame of b into one of a, where ``a_from_b`` are (N, 3)."""
    x, y, yaw = poses.T
    cos, sin, zero = np.cos(yaw), np.sin(yaw), np.zeros(len(poses))
    rows = [[cos, -sin, y], [sin, cos, -x], [zero, zero, zero + 1.0]]
    return np.moveaxis(np.array(rows), -1, 0)
