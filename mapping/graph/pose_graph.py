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
from racecar.mapping.graph.constraint import Constraint, ConstraintList
from racecar.maps.geometry.se2 import Pose, are_apart, between, compose

_Loss = gtsam.noiseModel.mEstimator
_ANCHOR_SIGMA = 1e-4
"""Metres and radians of the prior on the first pose: small beside any measurement, so that it stays where it
is, and large enough for the equations to remain well conditioned."""
_LOSS_WIDTHS = (30.0, 5.0, 1.0)
"""Standard deviations that the Cauchy loss of loop closures is wide, one solution after the other: annealed,
because true ones far from the first estimate are let go when it is narrow at once, however well they agree;
the three steps are by judgement. In the end, one that misses by one standard deviation counts half."""
_WIDEST_MATCH_LOSS = 5.0
"""The same of scan matches at most, since they begin nearer to the estimate. Measured on a drive whose first
wheel steps turned too far: with 1 a wall is drawn twice, with 5 as with 30 once."""
_WHEEL_LOSS_WIDTH = 1.345
"""The same of the Huber loss of wheels where scans were matched too: there the estimate of Gaussian errors is
95 % as good as the best (Huber, 1981)."""
_TOLERANCE, _ROUGH_TOLERANCE = 1e-4, 1e-3
"""Relative decrease of the error at which Levenberg-Marquardt stops, by judgement, and while the drive goes
on, because poses to a few centimetres are enough then."""
_MOST_SOLVED_SINGLY = 4000
"""The latest keyframes that are solved one by one while the drive goes on; those before move by groups.
Measured on simulated kilometres (pytest -m slow, test_kilometres): with 1000 a loop came out 0.28 m off, with
4000 it stays below the bar of 0.25 m; solving all takes seconds."""
_STRAINED = (0.15, 0.03)
"""Metres and radians by which a new loop closure contradicts the poses so that the graph is solved anew. By
judgement: three cells of the map."""
_REFUTED = (0.3, 0.06)
"""The same by which the final solution contradicts a loop closure that is then dropped. By judgement: twice
what is worth a new solution."""


class PoseGraph:
    """Constraints between keyframes.

    Their factors are built for each solution, which takes at most a seventh of the time of solving; kept,
    they would take twice the memory of the constraints.
    """

    def __init__(self, constraints: Iterable[Constraint] = ()) -> None:
        self.constraints = ConstraintList(constraints)

    def add(self, constraint: Constraint) -> None:
        """Take a constraint into the graph; all but loop closures come in the order of their second
        keyframes."""
        self.constraints.append(constraint)

    def followed_by(self, constraints: Iterable[Constraint]) -> "PoseGraph":
        """Another graph with further constraints; this one stays as it is."""
        graph = PoseGraph()
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
        start, ends = self._start_of(first), self.constraints.ends
        are_neighbours = (ends[:, 1] == ends[:, 0] + 1) & self.constraints.are("scan_matching")
        is_worth = is_kept[ends].any(axis=1) | are_neighbours | self.constraints.are("loop_closure")
        left = start + np.flatnonzero(is_worth[start:])
        left = left[np.argsort(ends[left, 1], kind="stable")]
        self.constraints = self.constraints.chosen(np.append(np.arange(start), left))

    def optimize(self, poses: Pose) -> Pose:
        """The poses (K, 3) that agree best with all constraints; the first one stays where it is."""
        return self._anneal(poses, _LOSS_WIDTHS, _TOLERANCE)

    def optimize_roughly(self, poses: Pose, first: int = 0) -> Pose:
        """The same to a few centimetres, enough while the drive goes on; keyframes before ``first`` stay
        where they are."""
        return self._anneal(poses, _LOSS_WIDTHS[:2], _ROUGH_TOLERANCE, first)

    def optimize_by_groups(self, poses: Pose, groups: Groups) -> Pose:
        """`optimize_roughly`, but of very many keyframes only the latest are solved one by one, after all
        have been moved by groups."""
        first = max(len(poses) - _MOST_SOLVED_SINGLY, 0)
        if first > 0:
            coarse = between_groups(self.constraints, poses, groups, _LOSS_WIDTHS[-1])
            middles = PoseGraph(coarse).optimize_roughly(poses[groups.middles])
            poses = groups.carry(poses, middles)
        return self.optimize_roughly(poses, first)

    def optimize_since(self, poses: Pose, first: int = 0) -> Pose:
        """`optimize` for the keyframes from ``first`` on, where nothing needs to be annealed any more; those
        before stay where they are.

        The poses may be those of the first keyframes only.
        """
        return self._anneal(poses, _LOSS_WIDTHS[-1:], _TOLERANCE, first)

    def _anneal(self, poses: Pose, widths: Sequence[float], tolerance: float, first: int = 0) -> Pose:
        among = self._among(first, len(poses))
        ordering = _ordering(range(first, len(poses)), [(c.from_keyframe, c.to_keyframe) for c in among])
        loops = [constraint for constraint in among if constraint.kind == "loop_closure"]
        match_widths = {width: min(width, _WIDEST_MATCH_LOSS) for width in widths}
        if not loops:
            match_widths = {width: width for width in match_widths.values()}
        local = {w: self._local_graph(among, w, poses, first) for w in set(match_widths.values())}
        for width, match_width in match_widths.items():
            graph = gtsam.NonlinearFactorGraph(local[match_width])
            for loop in loops:
                graph.add(_factor(loop, _Loss.Cauchy.Create(width), poses, first))
            stop = tolerance if width == widths[-1] else _ROUGH_TOLERANCE
            poses = np.concatenate([poses[:first], _solve(graph, poses[first:], first, ordering, stop)])
        return poses

    def _local_graph(
        self, among: Sequence[Constraint], match_width: float, poses: Pose, first: int
    ) -> gtsam.NonlinearFactorGraph:
        """All but the loop closures, scan matches with a loss of that width."""
        graph, are_matched = gtsam.NonlinearFactorGraph(), _matched_steps(among, len(poses))
        of_matches = _Loss.Cauchy.Create(match_width)
        of_wheels = _Loss.Huber.Create(_WHEEL_LOSS_WIDTH)
        for c in among:
            if c.kind == "scan_matching":
                graph.add(_factor(c, of_matches, poses, first))
            elif c.kind == "odometry":
                graph.add(_factor(c, of_wheels if are_matched[c.to_keyframe] else None, poses, first))
        if first == 0:
            noise = gtsam.noiseModel.Isotropic.Sigma(3, _ANCHOR_SIGMA)
            graph.add(gtsam.PriorFactorPose2(0, gtsam.Pose2(*poses[0]), noise))
        return graph

    def _among(self, first: int, end: int) -> list[Constraint]:
        """The constraints of keyframes from ``first`` on and before ``end``, the latest first."""
        later = self.since(first)
        latest = later.ends[:, 1]
        return list(later.chosen(np.flatnonzero((first <= latest) & (latest < end))[::-1]))

    def _start_of(self, first: int) -> int:
        """Where the constraints of keyframes from ``first`` on begin."""
        are_before = (self.constraints.ends[:, 1] < first) & ~self.constraints.are("loop_closure")
        return int(np.max(np.flatnonzero(are_before), initial=-1)) + 1

    def optimize_finally(self, poses: Pose, *, are_near: bool = False) -> Pose:
        """Optimize, and once more without the loop closures that the solution refutes. Poses (K, 3) that
        ``are_near`` the solution need no annealing."""
        poses = self.optimize_since(poses) if are_near else self.optimize(poses)
        loops = np.flatnonzero(self.constraints.are("loop_closure")).tolist()
        refuted = [k for k in loops if _is_contradicted(self.constraints[k], poses, _REFUTED)]
        if not refuted:
            return poses
        self.constraints = self.constraints.chosen(np.delete(np.arange(len(self.constraints)), refuted))
        return self.optimize_finally(poses, are_near=True)

    def close(self, closures: Sequence[Constraint], poses: Pose, groups: Groups, tied_until: int = 0) -> Pose:
        """Take loop closures into the graph; where they strain the poses (K, 3), optimize these roughly.

        At first only those from keyframe ``tied_until`` on, which costs the same however long the drive was;
        if that leaves a closure strained, all.
        """
        for closure in closures:
            self.add(closure)
        if tied_until > 0 and are_strained(closures, poses):
            poses = self.optimize_roughly(poses, tied_until)
        return self.optimize_by_groups(poses, groups) if are_strained(closures, poses) else poses


def are_strained(closures: Iterable[Constraint], poses: Pose) -> bool:
    """Does any loop closure contradict the poses (K, 3) so much that it is worth optimizing anew?"""
    return any(_is_contradicted(closure, poses, _STRAINED) for closure in closures)


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
