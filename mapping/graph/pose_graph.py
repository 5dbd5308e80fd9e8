"""The pose graph: keyframes as nodes, constraints as edges, solved by GTSAM.

Scan matches and loop closures have a Cauchy loss. That of the loop closures is annealed: wide at first, so
that true closures far from the present estimate still pull, and narrow in the end, so that false ones let go.
Odometry is not robust: where it is all there is, along bare corridors, a robust chain would tear at one link
instead of sharing the error out.
"""

from collections.abc import Iterable, Sequence

import gtsam
import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.coarse_graph import Groups, between_groups
from racecar.mapping.graph.constraint import Constraint, ConstraintList
from racecar.maps.geometry.se2 import Pose, are_apart, between, compose

_ANCHOR_SIGMA = 1e-4
_LOCAL_WIDTH = 1.0
_LOOP_WIDTHS = (30.0, 5.0, 1.0)
_TOLERANCE = 1e-4
_ROUGH_TOLERANCE = 1e-3
_ONE_BY_ONE = 4000
"""Keyframes, at most, that are optimized each for itself while the drive goes on."""
_STRAINED = (0.15, 0.03)
_REFUTED = (0.3, 0.06)


class PoseGraph:
    """Constraints between keyframes.

    Their factors are made anew each time, which takes at most a seventh of the time that solving does: kept,
    they would take twice the memory of the constraints.
    """

    def __init__(self, constraints: Iterable[Constraint] = ()) -> None:
        self.constraints = ConstraintList(constraints)

    def add(self, constraint: Constraint) -> None:
        """Take a constraint into the graph; they come in the order of their second keyframes, loop closures
        excepted."""
        self.constraints.append(constraint)

    def give_up(self, is_held: NDArray[np.bool_], first: int) -> None:
        """Of what ties two keyframes from ``first`` on that are not held, (K,), keep only loop closures and
        matches of neighbours. Those constraints come to be in the order of their second keyframes."""
        start, ends = self._start_of(first), self.constraints.to_arrays()["keyframes"]
        are_neighbours = (ends[:, 1] == ends[:, 0] + 1) & self.constraints.are("scan_matching")
        is_worth = is_held[ends].any(axis=1) | are_neighbours | self.constraints.are("loop_closure")
        kept = start + np.flatnonzero(is_worth[start:])
        kept = kept[np.argsort(ends[kept, 1], kind="stable")]
        self.constraints = self.constraints.chosen(np.append(np.arange(start), kept))

    def optimize(self, poses: Pose) -> Pose:
        """The poses (K, 3) that agree best with all constraints; the first one is held where it is."""
        return self._anneal(poses, _LOOP_WIDTHS, _TOLERANCE)

    def optimize_roughly(self, poses: Pose, first: int = 0) -> Pose:
        """The same to a few centimetres, which is as much as a drive that goes on has use for; keyframes
        before ``first`` are held where they are."""
        return self._anneal(poses, _LOOP_WIDTHS[:2], _ROUGH_TOLERANCE, first)

    def optimize_by_groups(self, poses: Pose, groups: Groups) -> Pose:
        """`optimize_roughly`, but where there are many keyframes they are moved by groups, and then only the
        latest of them one by one."""
        first = max(len(poses) - _ONE_BY_ONE, 0)
        if first > 0:
            graph = PoseGraph(between_groups(self.constraints, poses, groups))
            middles = graph._anneal(poses[groups.middles], _LOOP_WIDTHS[:2], _ROUGH_TOLERANCE)
            poses = groups.carry(poses, middles)
        return self.optimize_roughly(poses, first)

    def optimize_since(self, poses: Pose, first: int) -> Pose:
        """`optimize` for the keyframes from ``first`` on; those before are held where they are.

        The poses may be those of the first keyframes only.
        """
        return self._anneal(poses, _LOOP_WIDTHS[-1:], _TOLERANCE, first)

    def _anneal(self, poses: Pose, widths: tuple[float, ...], tolerance: float, first: int = 0) -> Pose:
        local, loops = gtsam.NonlinearFactorGraph(), []
        among = self._among(first, len(poses))
        ordering = _ordering(range(first, len(poses)), [(c.from_keyframe, c.to_keyframe) for c in among])
        for constraint in among:
            if constraint.kind == "loop_closure":
                loops.append(constraint)
            else:
                local.add(_factor(constraint, _LOCAL_WIDTH, poses, first))
        if first == 0:
            _anchor(local, 0, poses[0])
        for width in widths if loops else widths[-1:]:
            graph = gtsam.NonlinearFactorGraph(local)
            for loop in loops:
                graph.add(_factor(loop, width, poses, first))
            poses = np.concatenate([poses[:first], _solve(graph, poses[first:], first, ordering, tolerance)])
        return poses

    def _among(self, first: int, end: int) -> list[Constraint]:
        """The constraints of keyframes from ``first`` on and before ``end``, the latest first."""
        since = reversed(range(self._start_of(first), len(self.constraints)))
        return [self.constraints[k] for k in since if first <= self.constraints.ends_of(k)[1] < end]

    def _start_of(self, first: int) -> int:
        """Where the constraints of keyframes from ``first`` on begin.

        Those that were added long before are not looked at, so that this costs the same all day.
        """
        for k in reversed(range(len(self.constraints))):
            if self.constraints.ends_of(k)[1] < first and self.constraints.kind_of(k) != "loop_closure":
                return k + 1
        return 0

    def settle(self, poses: Pose) -> Pose:
        """Optimize, and once more without the loop closures that the solution does not bear out."""
        poses = self.optimize(poses)
        return self.optimize(poses) if self._drop_refuted(poses) else poses

    def close(self, closures: Sequence[Constraint], poses: Pose, groups: Groups, tied_until: int = 0) -> Pose:
        """Take loop closures into the graph; where they strain the poses (K, 3), optimize these roughly.

        At first only those from keyframe ``tied_until`` on, which costs the same all day; when the strain is
        not theirs, all.
        """
        for closure in closures:
            self.add(closure)
        if tied_until > 0 and _are_strained(closures, poses):
            poses = self.optimize_roughly(poses, tied_until)
        return self.optimize_by_groups(poses, groups) if _are_strained(closures, poses) else poses

    def _drop_refuted(self, poses: Pose) -> bool:
        """Take out the loop closures that the solution does not bear out; tells whether there were any."""
        kept = [
            k
            for k in range(len(self.constraints))
            if self.constraints.kind_of(k) != "loop_closure"
            or not is_strained(self.constraints[k], poses, _REFUTED)
        ]
        found = len(kept) < len(self.constraints)
        self.constraints = self.constraints.chosen(kept)
        return found


def is_strained(constraint: Constraint, poses: Pose, limits: tuple[float, float] = _STRAINED) -> bool:
    """Does a constraint contradict the poses (K, 3) by more than ``limits``, metres and radians?

    The usual limits are those beyond which it is worth optimizing anew.
    """
    solved = between(poses[constraint.from_keyframe], poses[constraint.to_keyframe])
    return are_apart(constraint.from_pose_to_pose, solved, limits)


def _are_strained(constraints: Sequence[Constraint], poses: Pose) -> bool:
    return any(is_strained(constraint, poses) for constraint in constraints)


def _noise(constraint: Constraint, width: float) -> gtsam.noiseModel.Base:
    noise = gtsam.noiseModel.Gaussian.Information(constraint.information)
    if constraint.kind == "odometry":
        return noise
    return gtsam.noiseModel.Robust.Create(gtsam.noiseModel.mEstimator.Cauchy.Create(width), noise)


def _factor(constraint: Constraint, width: float, poses: Pose, first: int) -> gtsam.NoiseModelFactor:
    """A constraint as a factor; keyframes before ``first`` are held where they are in the poses (K, 3)."""
    noise = _noise(constraint, width)
    start, end = constraint.from_keyframe, constraint.to_keyframe
    if start >= first:
        return gtsam.BetweenFactorPose2(start, end, gtsam.Pose2(*constraint.from_pose_to_pose), noise)
    measured = compose(poses[start], constraint.from_pose_to_pose)
    return gtsam.PriorFactorPose2(end, gtsam.Pose2(*measured), noise)


def _anchor(graph: gtsam.NonlinearFactorGraph, key: int, pose: Pose) -> None:
    noise = gtsam.noiseModel.Isotropic.Sigma(3, _ANCHOR_SIGMA)
    graph.add(gtsam.PriorFactorPose2(key, gtsam.Pose2(*pose), noise))


def _ordering(keyframes: range, ends: Iterable[tuple[int, int]]) -> gtsam.Ordering:
    """In which order to eliminate keyframes, by nested dissection [Karypis and Kumar 1998]. Where a drive has
    come to the same places for hours, it takes a tenth of the time that gtsam's usual COLAMD takes.

    METIS crashes on a keyframe that nothing connects with another, so each is taken to be with the next.
    """
    graph = gtsam.SymbolicFactorGraph()
    graph.push_factor(keyframes[0])
    for keyframe in keyframes[1:]:
        graph.push_factor(keyframe - 1, keyframe)
    for first, second in ends:
        if first in keyframes:
            graph.push_factor(first, second)
    return gtsam.Ordering.MetisSymbolicFactorGraph(graph)


def _solve(
    graph: gtsam.NonlinearFactorGraph, poses: Pose, first: int, ordering: gtsam.Ordering, tolerance: float
) -> NDArray[np.float64]:
    values = gtsam.Values()
    for key, pose in enumerate(poses, start=first):
        values.insert(key, gtsam.Pose2(*pose))
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setOrdering(ordering)
    parameters.setRelativeErrorTol(tolerance)
    solution = gtsam.LevenbergMarquardtOptimizer(graph, values, parameters).optimize()
    nodes = (solution.atPose2(key) for key in range(first, first + len(poses)))
    return np.array([[node.x(), node.y(), node.theta()] for node in nodes])
