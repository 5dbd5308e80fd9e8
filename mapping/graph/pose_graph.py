"""The pose graph: keyframes as nodes, constraints as edges, solved by GTSAM.

Scan matches and loop closures have a Cauchy loss, which is annealed: wide at first, so that true ones far
from the present estimate still pull, and those that agree pull together; and narrow in the end, so that false
ones lose their influence (graduated non-convexity: Blake and Zisserman, 1987). Wheels have a Huber loss over
steps that scans were matched across, so that they yield where they slip; where wheels are all there is, a
robust chain would tear at one link instead of sharing out the error.
"""

from collections.abc import Iterable, Sequence

import gtsam
import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.coarse_graph import Groups, between_groups
from racecar.mapping.graph.config import PoseGraphConfig
from racecar.mapping.graph.constraint import Constraint, ConstraintList
from racecar.maps.geometry.se2 import Pose, are_apart, between, compose

_Loss = gtsam.noiseModel.mEstimator
_ANCHOR_SIGMA = 1e-4
"""Metres and radians of the prior on the first pose: small beside any measurement, so that it stays where it
is, and large enough for the equations to remain well conditioned."""


class PoseGraph:
    """Constraints between keyframes.

    Their factors are built for each solution, which takes at most a seventh of the time of solving; kept,
    they would take twice the memory of the constraints.
    """

    def __init__(self, config: PoseGraphConfig, constraints: Iterable[Constraint] = ()) -> None:
        self.config = config
        self.constraints = ConstraintList(constraints)

    def add(self, constraint: Constraint) -> None:
        """Take a constraint into the graph; all but loop closures come in the order of their second
        keyframes."""
        self.constraints.append(constraint)

    def followed_by(self, constraints: Iterable[Constraint]) -> "PoseGraph":
        """Another graph with further constraints; this one stays as it is."""
        graph = PoseGraph(self.config)
        graph.constraints = self.constraints.copy()
        for constraint in constraints:
            graph.add(constraint)
        return graph

    def since(self, first: int) -> ConstraintList:
        """The constraints of keyframes from ``first`` on with these and earlier ones."""
        return self.constraints.since(self._start_of(first))

    def trim(self, is_kept: NDArray[np.bool_], first: int) -> None:
        """Of the constraints between two keyframes from ``first`` on whose scans are not kept, (K,), leave
        only loop closures and matches of neighbours. The constraints from there on are then sorted by their
        second keyframes."""
        start, ends = self._start_of(first), self.constraints.to_arrays()["keyframes"]
        are_neighbours = (ends[:, 1] == ends[:, 0] + 1) & self.constraints.are("scan_matching")
        is_worth = is_kept[ends].any(axis=1) | are_neighbours | self.constraints.are("loop_closure")
        left = start + np.flatnonzero(is_worth[start:])
        left = left[np.argsort(ends[left, 1], kind="stable")]
        self.constraints = self.constraints.chosen(np.append(np.arange(start), left))

    def optimize(self, poses: Pose) -> Pose:
        """The poses (K, 3) that agree best with all constraints; the first one stays where it is."""
        return self._anneal(poses, self.config.loss_widths, self.config.tolerance)

    def optimize_roughly(self, poses: Pose, first: int = 0) -> Pose:
        """The same to a few centimetres, enough while the drive goes on; keyframes before ``first`` stay
        where they are."""
        return self._anneal(poses, self.config.loss_widths[:2], self.config.rough_tolerance, first)

    def optimize_by_groups(self, poses: Pose, groups: Groups) -> Pose:
        """`optimize_roughly`, but of very many keyframes only the latest are solved one by one, after all
        have been moved by groups."""
        first = max(len(poses) - self.config.most_solved_singly, 0)
        if first > 0:
            coarse = between_groups(self.constraints, poses, groups, self.config.loss_widths[-1])
            middles = PoseGraph(self.config, coarse).optimize_roughly(poses[groups.middles])
            poses = groups.carry(poses, middles)
        return self.optimize_roughly(poses, first)

    def optimize_since(self, poses: Pose, first: int) -> Pose:
        """`optimize` for the keyframes from ``first`` on; those before stay where they are.

        The poses may be those of the first keyframes only.
        """
        return self._anneal(poses, self.config.loss_widths[-1:], self.config.tolerance, first)

    def _anneal(self, poses: Pose, widths: Sequence[float], tolerance: float, first: int = 0) -> Pose:
        among = self._among(first, len(poses))
        ordering = _ordering(range(first, len(poses)), [(c.from_keyframe, c.to_keyframe) for c in among])
        loops = [constraint for constraint in among if constraint.kind == "loop_closure"]
        widest = self.config.widest_match_loss
        if not loops:
            widths = list(dict.fromkeys(min(width, widest) for width in widths))
        local = {w: self._local_graph(among, w, poses, first) for w in {min(w, widest) for w in widths}}
        for width in widths:
            graph = gtsam.NonlinearFactorGraph(local[min(width, widest)])
            for loop in loops:
                graph.add(_factor(loop, _Loss.Cauchy.Create(width), poses, first))
            stop = tolerance if width == widths[-1] else self.config.rough_tolerance
            poses = np.concatenate([poses[:first], _solve(graph, poses[first:], first, ordering, stop)])
        return poses

    def _local_graph(
        self, among: Sequence[Constraint], match_width: float, poses: Pose, first: int
    ) -> gtsam.NonlinearFactorGraph:
        """All but the loop closures, scan matches with a loss of that width."""
        graph, are_matched = gtsam.NonlinearFactorGraph(), _matched_steps(among, len(poses))
        of_matches = _Loss.Cauchy.Create(match_width)
        of_wheels = _Loss.Huber.Create(self.config.wheel_loss_width)
        for c in among:
            if c.kind == "scan_matching":
                graph.add(_factor(c, of_matches, poses, first))
            elif c.kind == "odometry":
                graph.add(_factor(c, of_wheels if are_matched[c.to_keyframe] else None, poses, first))
        if first == 0:
            _anchor(graph, 0, poses[0])
        return graph

    def _among(self, first: int, end: int) -> list[Constraint]:
        """The constraints of keyframes from ``first`` on and before ``end``, the latest first."""
        since = reversed(range(self._start_of(first), len(self.constraints)))
        return [self.constraints[k] for k in since if first <= self.constraints.ends_of(k)[1] < end]

    def _start_of(self, first: int) -> int:
        """Where the constraints of keyframes from ``first`` on begin.

        Those added long before are not visited, so the cost does not grow with the length of the drive.
        """
        for k in reversed(range(len(self.constraints))):
            if self.constraints.ends_of(k)[1] < first and self.constraints.kind_of(k) != "loop_closure":
                return k + 1
        return 0

    def optimize_finally(self, poses: Pose) -> Pose:
        """Optimize, and once more without the loop closures that the solution refutes."""
        poses = self.optimize(poses)
        return self.optimize(poses) if self._drop_refuted(poses) else poses

    def close(self, closures: Sequence[Constraint], poses: Pose, groups: Groups, tied_until: int = 0) -> Pose:
        """Take loop closures into the graph; where they strain the poses (K, 3), optimize these roughly.

        At first only those from keyframe ``tied_until`` on, which costs the same however long the drive was;
        if that leaves a closure strained, all.
        """
        for closure in closures:
            self.add(closure)
        if tied_until > 0 and self._are_strained(closures, poses):
            poses = self.optimize_roughly(poses, tied_until)
        return self.optimize_by_groups(poses, groups) if self._are_strained(closures, poses) else poses

    def is_strained_by(self, closure: Constraint, poses: Pose) -> bool:
        """Does a loop closure contradict the poses (K, 3) so much that it is worth optimizing anew?"""
        limits = (self.config.strained_distance, self.config.strained_angle)
        return _is_contradicted(closure, poses, limits)

    def _are_strained(self, closures: Sequence[Constraint], poses: Pose) -> bool:
        """Does any closure contradict the poses (K, 3) so much?"""
        return any(self.is_strained_by(closure, poses) for closure in closures)

    def _drop_refuted(self, poses: Pose) -> bool:
        """Take out the loop closures that the solution refutes; returns whether there were any."""
        limits = (self.config.refuted_distance, self.config.refuted_angle)
        left = [
            k
            for k in range(len(self.constraints))
            if self.constraints.kind_of(k) != "loop_closure"
            or not _is_contradicted(self.constraints[k], poses, limits)
        ]
        found = len(left) < len(self.constraints)
        self.constraints = self.constraints.chosen(left)
        return found


def _matched_steps(constraints: Iterable[Constraint], end: int) -> NDArray[np.bool_]:
    """(end,) whether scans were matched across the step to each keyframe from the one before."""
    change = np.zeros(end + 1, dtype=np.int64)
    for constraint in constraints:
        if constraint.kind == "scan_matching":
            change[constraint.from_keyframe + 1] += 1
            change[constraint.to_keyframe + 1] -= 1
    matched: NDArray[np.bool_] = np.cumsum(change)[:-1] > 0
    return matched


def _is_contradicted(constraint: Constraint, poses: Pose, limits: tuple[float, float]) -> bool:
    """Do the poses (K, 3) contradict a constraint by more than ``limits``, metres and radians?"""
    solved = between(poses[constraint.from_keyframe], poses[constraint.to_keyframe])
    return are_apart(constraint.from_pose_to_pose, solved, limits)


def _factor(
    constraint: Constraint, loss: "gtsam.noiseModel.mEstimator.Base | None", poses: Pose, first: int
) -> gtsam.NoiseModelFactor:
    """A constraint as a factor; keyframes before ``first`` are fixed at their poses (K, 3)."""
    noise: gtsam.noiseModel.Base = gtsam.noiseModel.Gaussian.Information(constraint.information)
    if loss is not None:
        noise = gtsam.noiseModel.Robust.Create(loss, noise)
    start, end = constraint.from_keyframe, constraint.to_keyframe
    if start >= first:
        return gtsam.BetweenFactorPose2(start, end, gtsam.Pose2(*constraint.from_pose_to_pose), noise)
    measured = compose(poses[start], constraint.from_pose_to_pose)
    return gtsam.PriorFactorPose2(end, gtsam.Pose2(*measured), noise)


def _anchor(graph: gtsam.NonlinearFactorGraph, key: int, pose: Pose) -> None:
    noise = gtsam.noiseModel.Isotropic.Sigma(3, _ANCHOR_SIGMA)
    graph.add(gtsam.PriorFactorPose2(key, gtsam.Pose2(*pose), noise))


def _ordering(keyframes: range, ends: Iterable[tuple[int, int]]) -> gtsam.Ordering:
    """The order in which keyframes are eliminated, by nested dissection (Karypis and Kumar, 1998). For a
    drive that has passed the same places for hours it takes a tenth of the time of gtsam's default, COLAMD.

    METIS crashes on a keyframe that no constraint connects to another, so each is connected to the next.
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
