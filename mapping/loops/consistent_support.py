"""Consistent support: a true loop is confirmed by those of neighbouring submaps, a false one seldom is."""

import math
from collections.abc import Sequence

from racecar.mapping.loops.hypothesis import Hypothesis
from racecar.mapping.loops.submap_graph import SubmapGraph
from racecar.maps.geometry.se2 import Pose, are_apart, between, compose

_LIMITS = (0.35, math.radians(2.5))
"""Metres and radians by which one's prediction of the other may be off. Measured: chosen in a prototype on
aces, intel and fr079."""
_MIN_SPACING = 1.0
"""Metres of path between supporters at least, half the spacing of submaps, because closer ones see the
same."""
MAX_SPACING = 14.0
"""Metres of path over which drift stays within these limits. Chosen by judgement: seven submaps."""
_REACH_PER_SUPPORTER = 4.0
"""Metres of search window per required supporter, at least one, because wider windows have more false
matches."""


def is_supported(
    hypothesis: Hypothesis, others: Sequence[Hypothesis], graph: SubmapGraph, poses: Pose
) -> bool:
    """Whether enough hypotheses close along the path, including itself, are consistent with it. Wider search
    windows require more."""
    supporters = {
        other.moving.middle
        for other in others
        if other is not hypothesis and are_consistent(other, hypothesis, graph, poses)
    }
    return len(supporters) >= max(1.0, hypothesis.reach / _REACH_PER_SUPPORTER)


def are_consistent(one: Hypothesis, other: Hypothesis, graph: SubmapGraph, poses: Pose) -> bool:
    """Whether two hypotheses of neighbouring submaps predict each other, given keyframe ``poses`` (K, 3)."""
    apart = abs(graph.path[one.moving.middle] - graph.path[other.moving.middle])
    if not _MIN_SPACING <= apart <= MAX_SPACING:
        return False
    predicted = compose(
        compose(between(poses[one.fixed.middle], poses[other.fixed.middle]), other.fixed_from_moving),
        between(poses[other.moving.middle], poses[one.moving.middle]),
    )
    return not are_apart(one.fixed_from_moving, predicted, _LIMITS)
