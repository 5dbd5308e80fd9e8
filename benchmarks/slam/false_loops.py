"""How far wrong loop closures bend a map: as many as there are true ones, put into its finished graph."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.graph.pose_graph import PoseGraph
from racecar.mapping.state.result import MappingResult
from racecar.maps.geometry.se2 import Pose, between, compose
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.evaluation.relations import Relations, relation_errors

_WRONG_BY = 5.0
"""Metres; between places nearer than that a wrong loop is a bad match rather than a mistaken place."""
_DRAWS_PER_LOOP = 100
"""Random pairs of keyframes per true loop, enough that on any log of some metres one of them lies apart."""


@dataclass(frozen=True)
class FalseLoopFigures:
    """Mean errors over the relations when the graph is solved again, without and with wrong loops."""

    true_loops: int
    wrong_loops: int
    translation_before_m: float
    translation_after_m: float
    rotation_before_deg: float
    rotation_after_deg: float

    @property
    def translation_ratio(self) -> float:
        """After to before."""
        return self.translation_after_m / self.translation_before_m

    @property
    def rotation_ratio(self) -> float:
        """After to before."""
        return self.rotation_after_deg / self.rotation_before_deg

    def as_dict(self) -> dict[str, float]:
        """For a JSON file."""
        ratios = {"translation_ratio": self.translation_ratio, "rotation_ratio": self.rotation_ratio}
        return {**asdict(self), **ratios}


def with_false_loops(
    result: MappingResult, relations: Relations, rng: np.random.Generator
) -> FalseLoopFigures:
    """Solve the graph of a mapping run again, as it is and with wrong loops, and measure both."""
    keyframes = result.trajectory.map_from_base[result.keyframe_indices]
    true = [constraint for constraint in result.constraints if constraint.kind == "loop_closure"]
    wrong = wrong_loops(keyframes, true, rng)
    before = _error(result, _solve(keyframes, result.constraints), relations)
    after = _error(result, _solve(keyframes, [*result.constraints, *wrong]), relations)
    return FalseLoopFigures(
        true_loops=len(true),
        wrong_loops=len(wrong),
        translation_before_m=before["translation_mean_m"],
        translation_after_m=after["translation_mean_m"],
        rotation_before_deg=before["rotation_mean_deg"],
        rotation_after_deg=after["rotation_mean_deg"],
    )


def wrong_loops(
    map_from_keyframe: Pose, true: Sequence[Constraint], rng: np.random.Generator
) -> list[Constraint]:
    """As many loops as true ones, each the measurement of a random true one between two other keyframes.

    These (K, 3) lie over 5 m apart, and over 5 m from where the loop puts them. There are fewer loops, or
    none, where the car never was that far away.
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


def _error(result: MappingResult, map_from_keyframe: Pose, relations: Relations) -> dict[str, float]:
    """The figures when every scan moves rigidly with the last keyframe at or before it."""
    old, starts = result.trajectory.map_from_base, result.keyframe_indices
    keyframe = np.searchsorted(starts, np.arange(len(old)), side="right") - 1
    moved = compose(map_from_keyframe[keyframe], between(old[starts[keyframe]], old))
    return relation_errors(Trajectory(result.trajectory.stamps, moved), relations).summary()
