"""What a manual constraint did to a map, in figures and words."""

from dataclasses import dataclass

import numpy as np

from racecar.mapping.graph.constraint import ConstraintList
from racecar.mapping.graph.graph_edges import GraphEdges
from racecar.mapping.graph.pose_graph import STRAINED
from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import Pose

SHIFT = 0.05
"""Metres from which a keyframe was moved: a cell of the map, by definition of what is seen."""


@dataclass(frozen=True)
class Effect:
    """The difference that one constraint makes."""

    metres_of_path: float
    """Metres of path that it moved by a cell or more."""
    farthest: float
    """Metres by which it moved a keyframe at most."""
    contradicted: int
    """Matches and loop closures that agreed with the map before, and do not now."""
    agreeing: int
    """Those that agree now, and did not before."""
    cut: int
    """Constraints that it took out."""

    @property
    def summary(self) -> str:
        """A sentence for people."""
        moves = (
            f"It moves {self.metres_of_path:.0f} m of path by up to {self.farthest:.2f} m"
            if self.metres_of_path > 0.0
            else "It moves nothing by a cell"
        )
        further = []
        if self.cut:
            further.append(f"takes out {_counted(self.cut, 'tie')}")
        if self.contradicted:
            further.append(f"contradicts {_counted(self.contradicted, 'match')}")
        if self.agreeing:
            further.append(f"agrees with {_counted(self.agreeing, 'match')} that the map contradicted")
        return f"{'; '.join([moves, *further])}."


def effect_of(
    before: Pose, after: Pose, known: ConstraintList, left: ConstraintList, session: Session
) -> Effect:
    """The difference between keyframes at ``before`` and ``after`` (K, 3), with constraints ``known`` before
    and ``left`` then."""
    shifts = np.hypot(*(after - before)[:, :2].T)
    steps = np.append(session.times.driven(before), 0.0)
    contradicted_before = _are_contradicted(known, before)
    contradicted_after = _are_contradicted(known, after)
    remain = set(map(tuple, left.ends.tolist()))
    is_cut = np.array([tuple(pair) not in remain for pair in known.ends.tolist()], dtype=np.bool_)
    return Effect(
        float(steps[shifts >= SHIFT].sum()),
        float(shifts.max()),
        int(np.sum(contradicted_after & ~contradicted_before & ~is_cut)),
        int(np.sum(~contradicted_after & contradicted_before & ~is_cut)),
        int(np.sum(is_cut)),
    )


def _are_contradicted(constraints: ConstraintList, poses: Pose) -> np.ndarray:
    """(C,) bool, of scan matches and loop closures."""
    edges, (metres, radians) = GraphEdges.of(constraints, poses), STRAINED
    are_off = (np.hypot(*edges.errors[:, :2].T) > metres) | (np.abs(edges.errors[:, 2]) > radians)
    return np.asarray(are_off & ~edges.are("odometry"))


def _counted(count: int, what: str) -> str:
    plural = "es" if what.endswith("ch") else "s"
    return f"{count} {what}{plural if count > 1 else ''}"
