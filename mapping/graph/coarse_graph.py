"""A coarse pose graph of submaps, which is solved quickly however long the drive was.

Each keyframe moves rigidly with the nearest submap centre. All constraints between two such groups are
condensed into one, by a Gauss-Newton step at the current poses. Cf. Grisetti et al., "Hierarchical
Optimization on Manifolds for Online 2D and 3D Mapping", ICRA 2010.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import Constraint, ConstraintList
from racecar.maps.geometry.se2 import Pose, adjoint, between, compose, interpolate


@dataclass(frozen=True, eq=False)
class Groups:
    """Assignment of keyframes to submaps."""

    middles: NDArray[np.int64]
    """(M,) ascending indices of the keyframes at submap centres; at least one."""
    accumulated_drift: NDArray[np.float64]
    """(K,) accumulated drift along the path up to each keyframe, in any additive unit."""

    def nearest(self) -> NDArray[np.int64]:
        """(K,) group of each keyframe."""
        before, after, share = self._neighbours()
        return np.where(share > 0.5, after, before)

    def carry(self, map_from_keyframe: Pose, map_from_middle: Pose) -> Pose:
        """Move keyframe poses (K, 3) so that the submap centres are at ``map_from_middle`` (M, 3).

        A keyframe's correction is interpolated between the centres before and after it.
        """
        before, after, share = self._neighbours()

        def moved_with(group: NDArray[np.int64]) -> Pose:
            middle_from_keyframe = between(map_from_keyframe[self.middles[group]], map_from_keyframe)
            return compose(map_from_middle[group], middle_from_keyframe)

        return interpolate(moved_with(before), moved_with(after), share)

    def _neighbours(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
        """Groups (K,) before and after each keyframe, and its relative position (K,) between them: 0 to 1."""
        following = np.searchsorted(self.middles, np.arange(len(self.accumulated_drift)), side="right")
        before, after = np.maximum(following - 1, 0), np.minimum(following, len(self.middles) - 1)
        drift = self.accumulated_drift
        start, end = drift[self.middles[before]], drift[self.middles[after]]
        share = (drift - start) / np.maximum(end - start, 1e-12)
        return before, after, np.clip(share, 0.0, 1.0)


def between_groups(
    constraints: ConstraintList, map_from_keyframe: Pose, groups: Groups, match_loss_width: float
) -> list[Constraint]:
    """Condense constraints between keyframes at poses (K, 3) into constraints between groups.

    Loop closures connect submap centres and are kept. Scan matches are weighted by their current Cauchy loss
    with a width of ``match_loss_width`` standard deviations; the condensed constraints have no robust loss.
    """
    group = groups.nearest()
    is_loop = constraints.are("loop_closure")
    first, second = group[constraints.ends].T
    local = constraints.chosen(np.flatnonzero(~is_loop & (first != second)))
    closures = [
        replace(constraints[k], from_keyframe=int(first[k]), to_keyframe=int(second[k]))
        for k in np.flatnonzero(is_loop).tolist()
    ]
    middle = map_from_keyframe[groups.middles]
    return _condensed(local, map_from_keyframe, group, middle, match_loss_width) + closures


def _condensed(
    local: ConstraintList,
    map_from_keyframe: Pose,
    group: NDArray[np.int64],
    middle: Pose,
    match_loss_width: float,
) -> list[Constraint]:
    """One constraint per pair of connected groups, whose centres are at (M, 3)."""
    edges = local.to_arrays()
    first, second = edges["keyframes"].T
    error = between(edges["poses"], between(map_from_keyframe[first], map_from_keyframe[second]))
    information = edges["information"]
    squared = (error[:, None] @ information @ error[:, :, None])[:, :, 0]
    are_robust = local.are("scan_matching")[:, None]
    information = information / np.where(are_robust, 1.0 + squared / match_loss_width**2, 1.0)[:, :, None]
    # Moving a group by delta in the tangent frame of its centre adds jacobian @ delta to the error.
    jacobian = adjoint(between(map_from_keyframe[second], middle[group[second]]))
    weighted = jacobian.transpose(0, 2, 1) @ information
    pairs, pair = np.unique(group[first] * len(middle) + group[second], return_inverse=True)
    hessian, gradient = np.zeros((len(pairs), 3, 3)), np.zeros((len(pairs), 3, 1))
    np.add.at(hessian, pair, weighted @ jacobian)
    np.add.at(gradient, pair, weighted @ error[:, :, None])
    delta = -np.linalg.solve(hessian, gradient)[:, :, 0]
    earlier, later = np.divmod(pairs, len(middle))
    measured = compose(between(middle[earlier], middle[later]), delta)
    return [
        Constraint(a, b, pose, matrix, "odometry")
        for a, b, pose, matrix in zip(earlier.tolist(), later.tolist(), measured, hessian, strict=True)
    ]
