"""Consistent support: a true loop is confirmed by those of neighbouring submaps, a look-alike seldom is."""

from collections.abc import Sequence

import numpy as np

from racecar.mapping.loops.config import ConsistentSupportConfig
from racecar.mapping.loops.hypothesis import Hypothesis
from racecar.mapping.loops.submap_graph import SubmapGraph
from racecar.mapping.loops.verifier import LoopVerifier
from racecar.maps.geometry.se2 import Pose, between, compose


class ConsistentSupportVerifier(LoopVerifier):
    """Leaves a hypothesis open until enough neighbours along the path are consistent with it."""

    def __init__(self, config: ConsistentSupportConfig) -> None:
        self._config = config

    def leaves_open(
        self, hypothesis: Hypothesis, others: Sequence[Hypothesis], graph: SubmapGraph, poses: Pose
    ) -> bool:
        """The wider the window it was found in, the more support it needs."""
        supporters = {
            other.moving.middle
            for other in others
            if other is not hypothesis and are_consistent(other, hypothesis, graph, poses, self._config)
        }
        return len(supporters) < max(1.0, hypothesis.reach / self._config.reach_per_supporter)


def are_consistent(
    one: Hypothesis, other: Hypothesis, graph: SubmapGraph, poses: Pose, config: ConsistentSupportConfig
) -> bool:
    """Do two hypotheses of neighbouring submaps predict each other, keyframes at ``poses`` (K, 3)?"""
    apart = abs(graph.path[one.moving.middle] - graph.path[other.moving.middle])
    if apart > config.max_spacing or apart < config.min_spacing:
        return False
    predicted = compose(
        compose(between(poses[one.fixed.middle], poses[other.fixed.middle]), other.fixed_from_moving),
        between(poses[other.moving.middle], poses[one.moving.middle]),
    )
    error = between(one.fixed_from_moving, predicted)
    is_near = np.hypot(error[0], error[1]) < config.max_distance
    return bool(is_near and abs(error[2]) < config.max_angle)
