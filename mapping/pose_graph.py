"""The pose graph: keyframes as nodes, constraints as edges, solved by GTSAM.

Scan matches and loop closures have a Cauchy loss. That of the loop closures is annealed: wide at first, so
that true closures far from the present estimate still pull, and narrow in the end, so that false ones let go.
Odometry is not robust: where it is all there is, along bare corridors, a robust chain would tear at one link
instead of sharing the error out.
"""

from collections.abc import Sequence

import gtsam
import numpy as np
from numpy.typing import NDArray

from mapping.constraint import Constraint
from maps.se2 import Pose, between

_ANCHOR_SIGMA = 1e-4
_LOCAL_WIDTH = 1.0
_LOOP_WIDTHS = (30.0, 5.0, 1.0)
_TOLERANCE = 1e-4
_ROUGH_TOLERANCE = 1e-3
_STRAINED = (0.15, 0.03)
_REFUTED = (0.3, 0.06)


class PoseGraph:
    """Constraints between keyframes, kept as factors so that solving again costs only the solving."""

    def __init__(self) -> None:
        self.constraints: list[Constraint] = []
        self._factors: list[gtsam.BetweenFactorPose2] = []

    def add(self, constraint: Constraint) -> None:
        """Take a constraint into the graph."""
        self.constraints.append(constraint)
        self._factors.append(_factor(constraint, _LOCAL_WIDTH))

    def optimize(self, poses: Pose) -> Pose:
        """The poses (K, 3) that agree best with all constraints; the first one is held where it is."""
        return self._anneal(poses, _LOOP_WIDTHS, _TOLERANCE)

    def optimize_roughly(self, poses: Pose) -> Pose:
        """The same to a few centimetres, which is as much as a drive that goes on has use for."""
        return self._anneal(poses, _LOOP_WIDTHS[:2], _ROUGH_TOLERANCE)

    def _anneal(self, poses: Pose, widths: tuple[float, ...], tolerance: float) -> Pose:
        local, loops = gtsam.NonlinearFactorGraph(), []
        for constraint, factor in zip(self.constraints, self._factors, strict=True):
            if constraint.kind == "loop_closure":
                loops.append(constraint)
            else:
                local.add(factor)
        _anchor(local, 0, poses[0])
        for width in widths if loops else widths[-1:]:
            graph = gtsam.NonlinearFactorGraph(local)
            for constraint in loops:
                graph.add(_factor(constraint, width))
            poses = _solve(graph, poses, 0, tolerance)
        return poses

    def settle(self, poses: Pose) -> Pose:
        """Optimize, and once more without the loop closures that the solution does not bear out."""
        poses = self.optimize(poses)
        return self.optimize(poses) if self._drop_refuted(poses) else poses

    def close(self, closures: Sequence[Constraint], poses: Pose) -> Pose:
        """Take loop closures into the graph; where they strain the poses (K, 3), optimize these roughly."""
        for closure in closures:
            self.add(closure)
        strained = any(is_strained(closure, poses) for closure in closures)
        return self.optimize_roughly(poses) if strained else poses

    def _drop_refuted(self, poses: Pose) -> bool:
        """Take out the loop closures that the solution does not bear out; tells whether there were any."""
        kept = [
            k
            for k, constraint in enumerate(self.constraints)
            if constraint.kind != "loop_closure" or not is_strained(constraint, poses, _REFUTED)
        ]
        found = len(kept) < len(self.constraints)
        self.constraints = [self.constraints[k] for k in kept]
        self._factors = [self._factors[k] for k in kept]
        return found

    def optimize_latest(self, poses: Pose, first: int, held: int) -> Pose:
        """The same for the keyframes from ``first`` on, of which the first ``held`` stay where they are.

        Only the constraints that were added last are looked at: those whose keyframes all lie in the window.
        """
        graph = gtsam.NonlinearFactorGraph()
        for constraint, factor in zip(reversed(self.constraints), reversed(self._factors), strict=True):
            if constraint.to_keyframe < first and constraint.kind != "loop_closure":
                break
            if constraint.from_keyframe >= first:
                graph.add(factor)
        for key in range(first, first + held):
            _anchor(graph, key, poses[key])
        return np.concatenate([poses[:first], _solve(graph, poses[first:], first, _TOLERANCE)])


def is_strained(constraint: Constraint, poses: Pose, limits: tuple[float, float] = _STRAINED) -> bool:
    """Does a constraint contradict the poses (K, 3) by more than ``limits``, metres and radians?

    The usual limits are those beyond which it is worth optimizing anew.
    """
    solved = between(poses[constraint.from_keyframe], poses[constraint.to_keyframe])
    error = between(constraint.from_pose_to_pose, solved)
    return bool(np.hypot(error[0], error[1]) > limits[0] or abs(error[2]) > limits[1])


def _factor(constraint: Constraint, width: float) -> gtsam.BetweenFactorPose2:
    noise: gtsam.noiseModel.Base = gtsam.noiseModel.Gaussian.Information(constraint.information)
    if constraint.kind != "odometry":
        noise = gtsam.noiseModel.Robust.Create(gtsam.noiseModel.mEstimator.Cauchy.Create(width), noise)
    return gtsam.BetweenFactorPose2(
        constraint.from_keyframe,
        constraint.to_keyframe,
        gtsam.Pose2(*constraint.from_pose_to_pose),
        noise,
    )


def _anchor(graph: gtsam.NonlinearFactorGraph, key: int, pose: Pose) -> None:
    noise = gtsam.noiseModel.Isotropic.Sigma(3, _ANCHOR_SIGMA)
    graph.add(gtsam.PriorFactorPose2(key, gtsam.Pose2(*pose), noise))


def _solve(
    graph: gtsam.NonlinearFactorGraph, poses: Pose, first: int, tolerance: float
) -> NDArray[np.float64]:
    values = gtsam.Values()
    for key, pose in enumerate(poses, start=first):
        values.insert(key, gtsam.Pose2(*pose))
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setRelativeErrorTol(tolerance)
    solution = gtsam.LevenbergMarquardtOptimizer(graph, values, parameters).optimize()
    nodes = (solution.atPose2(key) for key in range(first, first + len(poses)))
    return np.array([[node.x(), node.y(), node.theta()] for node in nodes])
