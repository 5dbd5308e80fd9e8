"""Correct a map by hand: one manual constraint at a time, each solved with the whole graph. The method is on
this page."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from racecar.mapping import schedule
from racecar.mapping.graph.constraint import Constraint, ConstraintList, in_order
from racecar.mapping.graph.pose_graph import PoseGraph
from racecar.mapping.keyframes.constraints import LOOKBACK
from racecar.mapping.keyframes.final_optimization import mean_bend
from racecar.mapping.loops.loop_history import LoopHistory
from racecar.mapping.mending.cuts import mistaken_ties, without_distrusted
from racecar.mapping.mending.effect import SHIFT, Effect, effect_of
from racecar.mapping.mending.floor_plan_frame import Mark, plan_in_map, ties_of_marks, ties_to_plan
from racecar.mapping.mending.manual_constraints import (
    Distance,
    Distrust,
    Here,
    ManualConstraint,
    NotSamePlace,
    RightAngle,
    SamePlace,
    Straight,
)
from racecar.mapping.mending.moments import keyframe_at, keyframes_between
from racecar.mapping.mending.reconnection import close_loops, match_passes
from racecar.mapping.mending.same_place import tie_of_same_place
from racecar.mapping.mending.walls import WallPiece, constraints_between_walls, pieces_of
from racecar.mapping.session.measured import Measured
from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import Pose, compose, inverse

_ROUNDS = 3
"""Solutions about which lengths, angles and places on a plan are linearized. Chosen by judgement: in the last
they move by less than a hundredth."""


@dataclass(frozen=True, eq=False)
class _State:
    """What is known after some constraints."""

    poses: Pose
    """(K, 3)"""
    measured: ConstraintList
    """What is left of what scans and wheels measured."""
    history: LoopHistory
    is_trusted: NDArray[np.bool_]
    """(K,) scans that may be matched again."""
    loops: tuple[Constraint, ...] = ()
    """Closures found in the corrected map."""
    matches: tuple[Constraint, ...] = ()
    """Between passes that lie beside each other in the corrected map."""
    ties: tuple[Constraint, ...] = ()
    """Between moments at the same place."""
    walls: tuple[tuple[Distance | Straight | RightAngle, list[WallPiece]], ...] = ()
    marks: tuple[Mark, ...] = ()
    apart: NDArray[np.int64] = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64))
    """(N, 2) pairs of keyframes that are not at one place."""
    solved: ConstraintList = field(default_factory=ConstraintList)
    """All constraints of the solution, without loop closures that it contradicts."""
    plan_in_map: Pose | None = None
    """(3,) of the solution."""


class Mender:
    """Adds manual constraints to the graph of a session."""

    def __init__(self, session: Session) -> None:
        """The session is not changed; its earlier manual constraints are left out."""
        self._session, self._measured = session, session.as_measured
        known = self._measured
        is_trusted = np.ones(len(known.keyframes), dtype=np.bool_)
        self._states = [_State(known.map_from_keyframe, known.constraints, known.loops, is_trusted)]

    def add(self, constraint: ManualConstraint, shown: Pose | None = None) -> Effect:
        """Add a constraint and solve the graph again. Points of walls are where they are in the map with its
        keyframes at ``shown`` (K, 3), by default the session's.

        Raises RefusedConstraintError when it cannot be right; nothing is changed then.
        """
        before = self._states[-1]
        state = self._with(before, constraint, self._session.map_from_keyframe if shown is None else shown)
        state = self._solved(state)
        if np.hypot(*(state.poses - before.poses)[:, :2].T).max() > SHIFT:
            state = self._matched_again(self._with_loops_closed(state))
        self._states.append(state)
        return effect_of(before.poses, state.poses, before.measured, state.measured, self._measured)

    def undo(self) -> None:
        """Take back the last constraint."""
        if len(self._states) > 1:
            self._states.pop()

    def session(self) -> Session:
        """The corrected session. If places on a floor plan are known, it is in the plan's frame."""
        state = self._states[-1]
        if len(self._states) == 1:
            return self._measured
        measured = self._measured
        mended = replace(
            measured,
            map_from_keyframe=state.poses,
            constraints=ConstraintList(
                in_order([*self._of_keyframes(state), *ties_of_marks(state.marks, state.poses)])
            ),
            measured=Measured(measured.map_from_keyframe, measured.constraints, ""),
        )
        return mended if state.plan_in_map is None else mended.moved(inverse(state.plan_in_map))

    def _of_keyframes(self, state: _State) -> ConstraintList:
        """The constraints of the solution without those of the plan, which is no keyframe."""
        is_of_keyframes = (state.solved.ends < len(state.poses)).all(axis=1)
        return state.solved.chosen(np.flatnonzero(is_of_keyframes))

    def _with(self, state: _State, constraint: ManualConstraint, shown: Pose) -> _State:
        """The state with one more constraint, not yet solved."""
        measured, poses = self._measured, state.poses
        if isinstance(constraint, NotSamePlace):
            mistaken = mistaken_ties(constraint, state.measured, measured, poses)
            pair = [keyframe_at(each, measured) for each in (constraint.first, constraint.second)]
            left = state.measured.chosen(np.flatnonzero(~mistaken))
            history = state.history.without(state.measured.ends[mistaken])
            return replace(state, measured=left, history=history, apart=np.vstack([state.apart, pair]))
        if isinstance(constraint, Distrust):
            trusted = ConstraintList(
                in_order(without_distrusted(constraint, state.measured, measured, poses))
            )
            if constraint.source == "wheels":
                return replace(state, measured=trusted)
            are_in = keyframes_between(constraint.begin, constraint.end, measured)
            return replace(state, measured=trusted, is_trusted=state.is_trusted & ~are_in)
        if isinstance(constraint, SamePlace):
            tie = tie_of_same_place(constraint, measured, poses)
            history = state.history.with_tie(tie.from_keyframe, tie.to_keyframe)
            return replace(state, ties=(*state.ties, tie), history=history)
        if isinstance(constraint, Here):
            return replace(
                state, marks=(*state.marks, (keyframe_at(constraint.moment, measured), constraint))
            )
        pieces = pieces_of(constraint, measured.keyframes, shown)
        return replace(state, walls=(*state.walls, (constraint, pieces)))

    def _solved(self, state: _State, *, are_near: bool = False) -> _State:
        """The state with its graph solved, and without loop closures that the solution contradicts."""
        poses, plan = state.poses, state.plan_in_map
        if state.marks and plan is None:
            plan = plan_in_map(state.marks, compose(poses, self._measured.keyframe_from_base))
        rounds = _ROUNDS if state.walls or state.marks else 1
        for nth in range(rounds):
            manual = self._manual(replace(state, poses=poses, plan_in_map=plan))
            graph = PoseGraph(in_order([*state.measured, *state.loops, *state.matches, *manual]))
            nodes = poses if plan is None else np.concatenate([poses, plan[None]])
            nodes = graph.optimize_finally(nodes, are_near=are_near or nth > 0)
            poses, plan = nodes[: len(poses)], None if plan is None else nodes[-1]
        return replace(state, poses=poses, plan_in_map=plan, solved=graph.constraints)

    def _manual(self, state: _State) -> list[Constraint]:
        """The manual constraints, linearized about the poses; those of a plan only while it is a node."""
        of_walls = [
            each
            for constraint, pieces in state.walls
            for each in constraints_between_walls(constraint, pieces, state.poses)
        ]
        of_plan: list[Constraint] = []
        if state.plan_in_map is not None:
            nodes = np.concatenate([state.poses, state.plan_in_map[None]])
            of_plan = ties_to_plan(state.marks, nodes, self._measured.keyframe_from_base)
        return [*state.ties, *of_walls, *of_plan]

    def _with_loops_closed(self, state: _State) -> _State:
        """The state with loops closed that come within reach only now, from the last tie outwards."""
        history = state.history.frozen()
        manual = self._manual(replace(state, plan_in_map=None))
        graph = PoseGraph(in_order([*state.measured, *state.loops, *manual]))
        start = state.ties[-1].to_keyframe if state.ties else 0
        found, poses = close_loops(self._measured.keyframes, history, graph, state.poses, state.apart, start)
        closed = replace(state, poses=poses, loops=(*state.loops, *found), history=history)
        return self._solved(closed, are_near=True) if found else state

    def _matched_again(self, state: _State) -> _State:
        """The state with scans of neighbouring passes matched, until the path is settled: at first some match
        wrongly."""
        for _ in range(schedule.FINAL_ROUNDS):
            poses = state.poses
            matches = match_passes(
                self._measured.keyframes, state.is_trusted, state.measured, poses, state.apart
            )
            state = self._solved(replace(state, matches=tuple(matches)), are_near=True)
            if mean_bend(poses, state.poses, max(LOOKBACK)) < schedule.SETTLED_BEND:
                break
        return state
