"""Loop candidates: earlier submaps that may show the same place, given the uncertainty of the path
between."""

import math

import numpy as np

from racecar.mapping.loops.submap import Submap
from racecar.mapping.loops.submap_graph import SPACING, SubmapGraph
from racecar.maps.geometry.se2 import Pose
from racecar.sensors.matching.correlative_search import Window
from racecar.sensors.matching.scan_store import ScanStore

WITHOUT_DRIFT = Window(0.5, math.radians(4.0))
"""Search window without drift, metres and radians to each side. Chosen by judgement: more than keyframe
matching covers."""
_WIDEST = Window(20.0, math.radians(40.0))
"""Largest search window, metres and radians to each side, because of the time it takes."""
_SIGMAS = 4.0
"""Standard deviations of the path between that are added to the window. Measured: maps of aces, fr079 and
intel made without loops were off by up to 6.5 of turn and 5.4 of place, for the errors of matches in one
place are alike; with what is searched without drift, 4 reach as far as any of them."""
_MIN_DRIFT = 0.3
"""Metres of expected drift below which two submaps are already well connected, because keyframe matching
covers as much."""
_MOST_CANDIDATES = 4
"""Candidates of a new submap at most, because of the time it takes."""
_CANDIDATE_SPACING = 3.0
"""Metres between candidates, because one per place suffices."""


def candidates(
    query: Submap, among: int, graph: SubmapGraph, map_from_keyframe: Pose, store: ScanStore
) -> list[tuple[Submap, Window]]:
    """The nearest of the first ``among`` submaps within reach of one, one per place, with search windows as
    wide as the drift may be."""
    if among == 0:
        return []
    middles = map_from_keyframe[graph.middles(), :2]
    drift, drifted_turn = (_SIGMAS * each[:among] for each in graph.spreads_from(query.index, middles))
    apart = np.hypot(*(middles[:among] - middles[query.index]).T)
    reach = np.minimum(WITHOUT_DRIFT.reach + drift, _WIDEST.reach)
    turn = np.minimum(WITHOUT_DRIFT.turn + drifted_turn, _WIDEST.turn)
    share_keyframes = np.array([submap.last >= query.first for submap in graph.submaps[:among]])
    # The centres of two submaps of one place may be as far apart as consecutive submaps.
    possible = ~share_keyframes & (drift > _MIN_DRIFT) & (apart < reach + SPACING)
    chosen: list[tuple[Submap, Window]] = []
    # A place seen in many passes needs one candidate, the nearest.
    for index in np.argsort(np.where(possible, apart, np.inf), kind="stable").tolist():
        if not possible[index] or len(chosen) == _MOST_CANDIDATES:
            break
        if not graph.submaps[index].is_whole(store):
            continue
        others = (middles[submap.index] for submap, _ in chosen)
        if all(np.hypot(*(other - middles[index])) > _CANDIDATE_SPACING for other in others):
            chosen.append((graph.submaps[index], Window(float(reach[index]), float(turn[index]))))
    return chosen
