"""Place recognition: where on an earlier map a drive lies, when no pose is known.

Each submap of the drive is searched for all over the earlier map, in any heading. A place is believed once
the hypotheses of several submaps along the path are consistent, and nowhere else those of nearly as many are.
"""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from racecar.mapping.loops.consistent_support import are_consistent
from racecar.mapping.loops.hypothesis import Hypothesis
from racecar.mapping.loops.loop_closure import LoopCloser
from racecar.mapping.loops.submap import Submap
from racecar.mapping.matching.correlative_search import Fit, LikelihoodPyramid, Window, search
from racecar.mapping.session.config import PlaceRecognitionConfig
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose

_WORKERS = 2
"""Threads, since the search is one kernel without the interpreter's lock and small machines have two
cores."""


def recognize(
    loops: LoopCloser, earlier: int, poses: Pose, config: PlaceRecognitionConfig
) -> list[Hypothesis]:
    """Consistent hypotheses of where the submaps after the first ``earlier`` ones lie on these.

    The poses (K, 3) of both groups are in unrelated frames. Empty when the place was not recognized.
    """
    whole = [submap for submap in loops.history.submaps if loops.is_whole(submap)]
    places = _places([submap for submap in whole if submap.index < earlier], poses, config)
    pyramids = [
        LikelihoodPyramid(
            place.points(loops.store, poses, loops.config.submaps),
            config.radius,
            loops.store.config.correlative_search,
        )
        for place in places
    ]
    found: list[Hypothesis] = []
    for moving in [submap for submap in whole if submap.index >= earlier]:
        found += _seek(loops, moving, places, pyramids, poses, config)
        consistent = _best_supported(loops, found, poses, config)
        if consistent:
            return consistent
    return []


def _places(submaps: list[Submap], poses: Pose, config: PlaceRecognitionConfig) -> list[Submap]:
    """One submap of each place and heading."""
    chosen: list[Submap] = []
    for submap in submaps:
        if not any(
            _is_near(poses[other.middle], poses[submap.middle], config.place_spacing, config.place_turn)
            for other in chosen
        ):
            chosen.append(submap)
    return chosen


def _seek(
    loops: LoopCloser,
    moving: Submap,
    places: list[Submap],
    pyramids: list[LikelihoodPyramid],
    poses: Pose,
    config: PlaceRecognitionConfig,
) -> list[Hypothesis]:
    """The hypotheses of one submap that were not refuted: the best, and all that score nearly as high."""
    points = moving.sample(loops.store, poses, config.points, loops.config.submaps)
    if points is None:
        return []
    window = Window(config.reach, np.pi)

    def fit(pyramid: LikelihoodPyramid) -> Fit | None:
        return search(pyramid, points, IDENTITY, window, config.min_score, config.ambiguous_share)

    with ThreadPoolExecutor(_WORKERS) as pool:
        fits = [
            (found, place)
            for found, place in zip(pool.map(fit, pyramids), places, strict=True)
            if found is not None and found.runner_up == 0.0
        ]
    fits.sort(key=lambda found: -found[0].score)
    hypotheses: list[Hypothesis] = []
    seen: list[Pose] = []
    for found, place in fits:
        map_from_moving = compose(poses[place.middle], found.pose)
        is_known = any(
            _is_near(other, map_from_moving, config.same_distance, config.same_turn) for other in seen
        )
        if found.score < config.ambiguous_share * fits[0][0].score or is_known:
            continue
        seen.append(map_from_moving)
        hypothesis = loops.match(place, moving, poses, found.pose, config.reach)
        if hypothesis is not None:
            hypotheses.append(hypothesis)
    return hypotheses


def _best_supported(
    loops: LoopCloser, found: list[Hypothesis], poses: Pose, config: PlaceRecognitionConfig
) -> list[Hypothesis]:
    """The consistent hypotheses of clearly most submaps; empty while there are none."""
    graph, support_config = loops.history.graph, loops.config.consistent_support
    groups = [
        [g for g in found if g is h or are_consistent(g, h, graph, poses, support_config)] for h in found
    ]
    support = [len({h.moving.middle for h in group}) for group in groups]
    if not support or max(support) < config.min_support:
        return []
    winner = groups[int(np.argmax(support))]
    others = [n for n, group in zip(support, groups, strict=True) if not any(h in winner for h in group)]
    return winner if max(support) >= config.clear_majority * max(others, default=0) else []


def _is_near(a: Pose, b: Pose, distance: float, turn: float) -> bool:
    apart = between(a, b)
    return bool(np.hypot(apart[0], apart[1]) < distance and abs(apart[2]) < turn)
