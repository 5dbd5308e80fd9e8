"""How much wrong loop closures distort a map: as many as true ones, added to its finished graph."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from benchmarks.harness.table import Column
from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.graph.pose_graph import PoseGraph
from racecar.mapping.state.result import MappingResult
from racecar.maps.geometry.se2 import Pose, between, compose
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.runs.evaluation.relations import Relations, relation_errors

_WRONG_BY = 5.0
"""Metres; a wrong loop between closer places is a bad match rather than a confused place."""
_DRAWS_PER_LOOP = 100
"""Random pairs of keyframes per true loop: enough for one to be far apart on any log of some metres."""


@dataclass(frozen=True)
class FalseLoopFigures:
    """Mean errors over the relations after solving the graph again, without and with wrong loops."""

    true_loops: Annotated[int, Column("true loops")]
    wrong_loops: Annotated[int, Column("wrong loops")]
    translation_before_m: Annotated[float, Column("before (m)", ".4f")]
    translation_after_m: Annotated[float, Column("after (m)", ".4f")]
    translation_ratio: Annotated[float, Column("after / before (m)", ".3f")]
    rotation_before_deg: Annotated[float, Column("before (°)", ".3f")]
    rotation_after_deg: Annotated[float, Column("after (°)", ".3f")]
    rotation_ratio: Annotated[float, Column("after / before (°)", ".3f")]


def with_false_loops(
    result: MappingResult, relations: Relations, rng: np.random.Generator
) -> FalseLoopFigures:
    """Solve the graph of a mapping run again, as it is and with wrong loops, and measure both."""
    keyframes = result.trajectory.map_from_base[result.keyframe_indices]
    true = [constraint for constraint in result.constraints if constraint.kind == "loop_closure"]
    wrong = wrong_loops(keyframes, true, rng)
    metres_before, degrees_before = _errors(result, _solve(keyframes, result.constraints), relations)
    metres, degrees = _errors(result, _solve(keyframes, [*result.constraints, *wrong]), relations)
    return FalseLoopFigures(
        true_loops=len(true),
        wrong_loops=len(wrong),
        translation_before_m=metres_before,
        translation_after_m=metres,
        translation_ratio=metres / metres_before,
        rotation_before_deg=degrees_before,
        rotation_after_deg=degrees,
        rotation_ratio=degrees / degrees_before,
    )


def wrong_loops(
    map_from_keyframe: Pose, true: Sequence[Constraint], rng: np.random.Generator
) -> list[Constraint]:
    """As many wrong loops as true ones, each a random true one's measurement between two other keyframes.

    Keyframes (K, 3) of a loop are over 5 m apart, and over 5 m from where the loop puts them. There are fewer
    loops, or none, if the car never was that far away.
    """
    draws = _DRAWS_PER_LOOP * len(true)
    pairs = np.sort(rng.integers(0, len(map_from_keyframe), (draws, 2)), axis=1)
    copied = rng.integers(0, max(len(true), 1), draws)
    measured = np.array([loop.from_pose_to_pose for loop in true]).reshape(-1, 3)[copied]
    apart = between(map_from_keyframe[pairs[:, 0]], map_from_keyframe[pairs[:, 1]])
    missed_by = between(measured, apart)
    wrong = (np.hypot(apart[:, 0], apart[:, 1]) > _WRONG_BY) & (
        np.hypot(missed_by[:, 0], missed_by[:, 1]) > _WRONG_BY
    )
    rows = np.flatnonzero(wrong)[: len(true)]
    return [
        Constraint(int(a), int(b), loop.from_pose_to_pose, loop.information, "loop_closure")
        for (a, b), loop in zip(pairs[rows], (true[i] for i in copied[rows]), strict=True)
    ]


def _solve(map_from_keyframe: Pose, constraints: Sequence[Constraint]) -> Pose:
    return PoseGraph(constraints).optimize(map_from_keyframe)


def _errors(result: MappingResult, map_from_keyframe: Pose, relations: Relations) -> tuple[float, float]:
    """Mean errors, metres and degrees, if each scan moves rigidly with the last keyframe at or before it."""
    old, starts = result.trajectory.map_from_base, result.keyframe_indices
    keyframe = np.searchsorted(starts, np.arange(len(old)), side="right") - 1
    moved = compose(map_from_keyframe[keyframe], between(old[starts[keyframe]], old))
    found = relation_errors(Trajectory(result.trajectory.stamps, moved), relations).summary()
    return found["translation_mean_m"], found["rotation_mean_deg"]
