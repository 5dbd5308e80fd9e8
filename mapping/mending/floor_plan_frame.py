"""The frame of a floor plan as an additional node of the graph, with constraints to keyframes whose place on
the plan is known."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.mending.manual_constraints import Here
from racecar.maps.geometry.alignment import rigid_alignment
from racecar.maps.geometry.se2 import Pose, between, compose, inverse

_SIGMA = 0.03
"""Metres, standard deviation of a place on a floor plan. Chosen by judgement: a cell of the map."""
_SIGMA_YAW = math.radians(1.0)
"""Radians, the same of a heading there; chosen by judgement."""
_UNKNOWN = 1e-4
"""Information about a heading that was not given, because the solver factorizes it: 100 rad."""

Mark = tuple[int, Here]
"""A keyframe, and where it lies on the plan."""


def ties_to_plan(marks: Sequence[Mark], poses: Pose, keyframe_from_base: Pose) -> list[Constraint]:
    """Constraints from the plan, the last node of ``poses`` (K + 1, 3), to keyframes that lie on it, by the
    inverse mounts (K, 3)."""
    plan = len(poses) - 1
    return [
        _tie(here, plan, keyframe, between(poses[plan], poses[keyframe]), keyframe_from_base[keyframe])
        for keyframe, here in marks
    ]


def _tie(
    here: Here, plan: int, keyframe: int, plan_from_keyframe: Pose, keyframe_from_base: Pose
) -> Constraint:
    yaw = here.yaw if here.yaw is not None else compose(plan_from_keyframe, keyframe_from_base)[2]
    target = compose(np.array([*here.place, yaw]), inverse(keyframe_from_base))
    x, y, _ = keyframe_from_base
    shift = np.array([[1.0, 0.0, -y], [0.0, 1.0, x]]) / _SIGMA  # of the base, by a twist of the keyframe
    turn = _UNKNOWN if here.yaw is None else _SIGMA_YAW**-2
    return Constraint(plan, keyframe, target, shift.T @ shift + np.diag([0.0, 0.0, turn]), "manual")


def ties_of_marks(marks: Sequence[Mark], poses: Pose) -> list[Constraint]:
    """Constraints between consecutive marks as they lie in the solution (K, 3), for a graph without the
    plan."""
    keyframes = sorted({keyframe for keyframe, _ in marks})
    information = np.diag([_SIGMA**-2, _SIGMA**-2, _SIGMA_YAW**-2])
    return [
        Constraint(first, second, between(poses[first], poses[second]), information, "manual")
        for first, second in pairwise(keyframes)
    ]


def plan_in_map(marks: Sequence[Mark], map_from_base: Pose) -> Pose:
    """(3,) the plan's frame in the map, as the marks lie now: their least-squares alignment (Umeyama, 1991),
    or the one heading that is known."""
    keyframe, first = marks[0]
    turn = 0.0 if first.yaw is None else float(map_from_base[keyframe, 2] - first.yaw)
    driven = map_from_base[[keyframe for keyframe, _ in marks], :2]
    return rigid_alignment(np.array([here.place for _, here in marks]), driven, turn)
