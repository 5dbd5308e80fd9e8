"""The pose graph: keyframes are nodes, constraints are edges, and GTSAM optimizes it.

Scan matches and loop closures have a Cauchy loss that is annealed (graduated non-convexity: Blake and
Zisserman, 1987). It is wide at first, so that correct ones far from the estimate still pull together, and
narrow in the end, so that false ones lose their influence. Wheels have a Huber loss over steps with a scan
match, so that they yield where they slip. Where wheels are all there is, a robust chain would tear at one
edge instead of distributing the error; so would the matches along the path where a manual constraint pulls at
a keyframe, and they have the convex Huber loss then.
"""

from collections.abc import Iterable, Sequence

import gtsam
import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.coarse_graph import Groups, between_groups
from racecar.mapping.graph.constraint import SAME_PASS, Constraint, ConstraintList
from racecar.maps.geometry.se2 import Pose, are_apart, between, compose

_Loss = gtsam.noiseModel.mEstimator
_ANCHOR_SIGMA = 1e-4
"""Metres and radians of the prior on the first pose: small compared with any measurement, so that it stays
fixed, and large enough for the equations to remain well conditioned."""
_LOSS_WIDTHS = (30.0, 5.0, 1.0)
"""Widths of the loop closures' Cauchy loss in standard deviations, for successive solutions. It is annealed,
because a narrow loss would drop correct closures far from the first estimate, however well they agree; the
three steps are chosen by judgement. In the end, a residual of one standard deviation halves the weight."""
_WIDEST_MATCH_LOSS = 5.0
"""Upper limit of the same for scan matches, since they start closer to the estimate. Measured on a drive
whose first wheel steps turned too far: with 1 a wall is drawn twice, with 5 as with 30 once."""
_WHEEL_LOSS_WIDTH = 1.345
"""Width of the wheels' Huber loss where scans were matched too: 95 % efficient for Gaussian errors (Huber,
1981)."""
_TOLERANCE, _ROUGH_TOLERANCE = 1e-4, 1e-3
"""Relative decrease of the error at which Levenberg-Marquardt stops, at the end and during the drive, because
then centimetres suffice; chosen by judgement."""
_MOST_SOLVED_SINGLY = 4000
"""Most recent keyframes that are solved individually during the drive; earlier ones move in groups. Measured
on simulated kilometres (pytest -m slow, test_kilometres): with 1000 a loop came out 0.28 m off, with 4000 it
stays below the bar of 0.25 m; solving all takes seconds."""
STRAINED = (0.15, 0.03)
"""Metres and radians by which a new loop closure must contradict the poses to trigger an optimization. Chosen
by judgement: three cells of the map."""
_REFUTED = (0.3, 0.06)
"""The same for dropping a loop closure that contradicts the final solution. Chosen by judgement: twice the
trigger of an optimization."""


class PoseGraph:
    """Constraints between keyframes, with an optimizer.

    Factors are rebuilt for each optimization, which takes at most a seventh of the solving time; storing them
    would take twice the memory of the constraints.
    """

    def __init__(self, constraints: Iterable[Constraint] = ()) -> None:
        self.constraints = ConstraintList(constraints)

    def add(self, constraint: Constraint) -> None:
        """Add a constraint; all but loop closures must be in order of their second keyframes."""
        self.constraints.append(constraint)

    def followed_by(self, constraints: Iterable[Constraint]) -> "PoseGraph":
        """A new graph with further constraints; this one is not changed."""
        graph = PoseGraph()
        graph.constraints = self.constraints.copy()
        for constraint in constraints:
            graph.add(constraint)
        return graph

    def since(self, first: int) -> ConstraintList:
        """Constraints that keyframes from ``first`` on have with each other and with earlier ones."""
        return self.constraints.since(self._start_of(first))

    def trim(self, is_kept: NDArray[np.bool_], first: int) -> None:
        """Drop constraints between keyframes from ``first`` on whose scans are not kept, (K,), except loop
        closures and matches of neighbours. The constraints from there on are then sorted by their second
        keyframes."""
        start, ends = self._start_of(first), self.constraints.ends
        are_neighbours = (ends[:, 1] == ends[:, 0] + 1) & self.constraints.are("scan_matching")
        is_worth = is_kept[ends].any(axis=1) | are_neighbours | self.constraints.are("loop_closure")
        left = start + np.flatnonzero(is_worth[start:])
        left = left[np.argsort(ends[left, 1], kind="stable")]
        self.constraints = self.constraints.chosen(np.append(np.arange(start), left))

    def optimize(self, poses: Pose) -> Pose:
        """Optimize all poses (K, 3); the first one is fixed."""
        return self._anneal(poses, _LOSS_WIDTHS, _TOLERANCE)

    def optimize_roughly(self, poses: Pose, first: int = 0) -> Pose:
        """Optimize to a few centimetres, enough during the drive; keyframes before ``first`` are fixed."""
        return self._anneal(poses, _LOSS_WIDTHS[:2], _ROUGH_TOLERANCE, first)

    def optimize_by_groups(self, poses: Pose, groups: Groups) -> Pose:
        """Like `optimize_roughly`, but only the most recent of very many keyframes are solved individually,
        after all have moved in groups."""
        first = max(len(poses) - _MOST_SOLVED_SINGLY, 0)
        if first > 0:
            coarse = between_groups(self.constraints, poses, groups, _LOSS_WIDTHS[-1])
            middles = PoseGraph(coarse).optimize_roughly(poses[groups.middles])
            poses = groups.carry(poses, middles)
        return self.optimize_roughly(poses, first)

    def optimize_since(self, poses: Pose, first: int = 0) -> Pose:
        """Optimize keyframes from ``first`` on without annealing; those before are fixed.

        The poses may be a prefix of all keyframes.
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
        """All factors but loop closures; scan matches have a loss of this width."""
        graph, are_matched = gtsam.NonlinearFactorGraph(), _matched_steps(among, len(poses))
        of_matches = _Loss.Cauchy.Create(match_width)
        of_wheels = _Loss.Huber.Create(_WHEEL_LOSS_WIDTH)
        of_path = of_wheels if any(c.kind == "manual" for c in among) else of_matches
        for c in among:
            if c.kind == "scan_matching":
                is_along_path = abs(c.to_keyframe - c.from_keyframe) <= SAME_PASS
                graph.add(_factor(c, of_path if is_along_path else of_matches, poses, first))
            elif c.kind == "manual":
                graph.add(_factor(c, None, poses, first))
            elif c.kind == "odometry":
                graph.add(_factor(c, of_wheels if are_matched[c.to_keyframe] else None, poses, first))
        if first == 0:
            noise = gtsam.noiseModel.Isotropic.Sigma(3, _ANCHOR_SIGMA)
            graph.add(gtsam.PriorFactorPose2(0, gtsam.Pose2(*poses[0]), noise))
        return graph

    def _among(self, first: int, end: int) -> list[Constraint]:
        """Constraints of keyframes from ``first`` to before ``end``, latest first."""
        later = self.since(first)
        latest = later.ends[:, 1]
        return list(later.chosen(np.flatnonzero((first <= latest) & (latest < end))[::-1]))

    def _start_of(self, first: int) -> int:
        """Index of the first constraint of keyframes from ``first`` on."""
        are_before = (self.constraints.ends[:, 1] < first) & ~self.constraints.are("loop_closure")
        return int(np.max(np.flatnonzero(are_before), initial=-1)) + 1

    def optimize_finally(self, poses: Pose, *, are_near: bool = False) -> Pose:
        """Optimize, then once more without the loop closures that the solution contradicts. Poses (K, 3) that
        ``are_near`` the solution need no annealing."""
        poses = self.optimize_since(poses) if are_near else self.optimize(poses)
        loops = np.flatnonzero(self.constraints.are("loop_closure")).tolist()
        refuted = [k for k in loops if _is_contradicted(self.constraints[k], poses, _REFUTED)]
        if not refuted:
            return poses
        self.constraints = self.constraints.chosen(np.delete(np.arange(len(self.constraints)), refuted))
        return self.optimize_finally(poses, are_near=True)

    def close(self, closures: Sequence[Constraint], poses: Pose, groups: Groups, first_free: int = 0) -> Pose:
        """Add loop closures; if they contradict the poses (K, 3), optimize these roughly.

        At first only keyframes from ``first_free`` on, at a cost independent of the length of the drive; all
        of them if a closure is still contradicted.
        """
        for closure in closures:
            self.add(closure)
        if first_free > 0 and are_strained(closures, poses):
            poses = self.optimize_roughly(poses, first_free)
        return self.optimize_by_groups(poses, groups) if are_strained(closures, poses) else poses


def are_strained(closures: Iterable[Constraint], poses: Pose) -> bool:
    """Whether any loop closure contradicts the poses (K, 3) enough to optimize again."""
    return any(_is_contradicted(closure, poses, STRAINED) for closure in closures)


def _matched_steps(constraints: Iterable[Constraint], end: int) -> NDArray[np.bool_]:
    """(end,) whether scans were matched across the step from the previous keyframe."""
    change = np.zeros(end + 1, dtype=np.int64)
    for constraint in constraints:
        if constraint.kind == "scan_matching":
            change[constraint.from_keyframe + 1] += 1
            change[constraint.to_keyframe + 1] -= 1
    matched: NDArray[np.bool_] = np.cumsum(change)[:-1] > 0
    return matched


def _is_contradicted(constraint: Constraint, poses: Pose, limits: tuple[float, float]) -> bool:
    """Whether the poses (K, 3) violate a constraint by more than ``limits`` in metres and radians."""
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
    """Elimination order by nested dissection (Karypis and Kumar, 1998). If a drive passes the same places for
    hours, it takes a tenth of the time of gtsam's default, COLAMD.

    METIS crashes on unconnected keyframes, so each is connected to the next.
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
