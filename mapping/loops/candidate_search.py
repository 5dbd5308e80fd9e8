"""Candidates: the earlier submaps that may show the same place as one, by how far the steps in between may
err."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from racecar.mapping.loops.config import CandidateSearchConfig
from racecar.mapping.loops.submap import Submap
from racecar.mapping.loops.submap_graph import SubmapGraph
from racecar.mapping.matching.correlative_search import Window
from racecar.maps.geometry.se2 import Pose


@dataclass(frozen=True, eq=False)
class Candidate:
    """A submap that may show the same place."""

    submap: Submap
    window: Window
    """As wide as the drift may be."""


def candidates(
    query: Submap,
    among: int,
    graph: SubmapGraph,
    map_from_keyframe: Pose,
    is_usable: Callable[[Submap], bool],
    config: CandidateSearchConfig,
) -> list[Candidate]:
    """The nearest of the first ``among`` submaps that lie within reach of one, one of each place."""
    if among == 0:
        return []
    middles = map_from_keyframe[graph.middles(), :2]
    drift, drifted_turn = (config.sigmas * each[:among] for each in graph.spreads_from(query.index, middles))
    apart = np.hypot(*(middles[:among] - middles[query.index]).T)
    reach = np.minimum(config.base_reach + drift, config.max_reach)
    turn = np.minimum(config.base_turn + drifted_turn, config.max_turn)
    share_keyframes = np.array([submap.last >= query.first for submap in graph.submaps[:among]])
    possible = ~share_keyframes & (drift > config.min_drift) & (apart < reach + config.slack)
    chosen: list[Candidate] = []
    # A place seen in many passes needs one candidate, the nearest.
    for index in np.argsort(np.where(possible, apart, np.inf), kind="stable").tolist():
        if not possible[index] or len(chosen) == config.max_candidates:
            break
        if not is_usable(graph.submaps[index]):
            continue
        others = (middles[each.submap.index] for each in chosen)
        if all(np.hypot(*(other - middles[index])) > config.candidate_spacing for other in others):
            window = Window(float(reach[index]), float(turn[index]))
            chosen.append(Candidate(graph.submaps[index], window))
    return chosen
