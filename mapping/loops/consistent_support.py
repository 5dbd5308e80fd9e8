"""Consistent support: a true loop is confirmed by those of neighbouring submaps, a look-alike seldom is."""

import math
from collections.abc import Sequence

from racecar.mapping.loops.hypothesis import Hypothesis
from racecar.mapping.loops.submap_graph import SubmapGraph
from racecar.maps.geometry.se2 import Pose, are_apart, between, compose

_LIMITS = (0.35, math.radians(2.5))
"""Metres and radians by which what one predicts of the other may be off. Measured: chosen in a prototype on
aces, intel and fr079."""
_MIN_SPACING = 1.0
"""Metres of path between two that support each other, half the spacing of submaps, because nearer ones see
the same."""
MAX_SPACING = 14.0
"""Metres of path over which the drift stays within these limits; by judgement, seven submaps."""
_REACH_PER_SUPPORTER = 4.0
"""Metres of search window for each of which one supporter is needed, at least one, because more look-alikes
lie in a wider window."""


def is_supported(
    hypothesis: Hypothesis, others: Sequence[Hypothesis], graph: SubmapGraph, poses: Pose
) -> bool:
    """Are enough of the hypotheses near it along the path, itself among them, consistent with it? The wider
    the window it was found in, the more are needed."""
    supporters = {
        other.moving.middle
        for other in others
        if other is not hypothesis and are_consistent(other, hypothesis, graph, poses)
    }
    return len(supporters) >= max(1.0, hypothesis.reach / _REACH_PER_SUPPORTER)


def are_consistent(one: Hypothesis, other: Hypothesis, graph: SubmapGraph, poses: Pose) -> bool:
    """Do two hypotheses of neighbouring submaps predict each other, keyframes at ``poses`` (K, 3)?"""
    apart = abs(graph.path[one.moving.middle] - graph.path[other.moving.middle])
    if not _MIN_SPACING <= apart <= MAX_SPACING:
        return False
    predicted = compose(
        compose(between(poses[one.fixed.middle], poses[other.fixed.middle]), other.fixed_from_moving),
        between(poses[other.moving.middle], poses[one.moving.middle]),
    )
    return not are_apart(one.fixed_from_moving, predicted, _LIMITS)
