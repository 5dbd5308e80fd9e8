"""Place recognition: verify where a drive lies on an earlier map.

Candidates come from outside, from whatever knows the earlier map; here they are verified as loop closures
are. Each submap of the drive is matched, from its candidate pose, with those of the earlier map there. The
place is accepted once the hypotheses of several submaps are consistent, and nearly as many are consistent
nowhere else on the map.
"""

from collections.abc import Iterable

import numpy as np

from racecar.mapping.loops.candidate_search import WITHOUT_DRIFT
from racecar.mapping.loops.consistent_support import MAX_SPACING, are_consistent
from racecar.mapping.loops.hypothesis import Hypothesis
from racecar.mapping.loops.loop_closure import LoopCloser
from racecar.mapping.loops.submap import Submap
from racecar.mapping.session.rival_places import RivalPlaces
from racecar.mapping.session.unrecognized import Recognition
from racecar.maps.geometry.se2 import Pose, between, compose, inverse

_METRES_PER_RADIAN = 2.0
"""Metres equivalent to a radian in the similarity of two submaps' views. Chosen by judgement: as for pairs of
scans."""
_FARTHEST = 6.0
"""Metres between the centres of two submaps that are matched. Chosen by judgement: as across a hall, where
both see the same walls."""
_TRIED = 4
"""Submaps of the earlier map matched with one of the drive, most likely first, because of the time it
takes."""
_MIN_SUPPORT = 2
"""Submaps whose hypotheses must be consistent. Measured on 42 pairs of recordings from different buildings,
never two were; drives of 10 m through a mapped room had as many."""
_VERIFIED_SHARE = 0.5
"""Share of the last submaps tried that must be consistent, because in another building some are verified by
chance sooner or later, and most of the right ones are."""
_CLEAR_MAJORITY = 2
"""Required ratio of their number to that at any other place, so that there is no doubt; chosen by
judgement."""


def recognize(
    loops: LoopCloser,
    earlier: int,
    first: int,
    poses: Pose,
    places: Iterable[Pose | None],
    *,
    is_given: bool = False,
) -> list[Hypothesis]:
    """Find where submaps after the first ``earlier`` ones lie on these: consistent hypotheses. Raises
    NotRecognizedError, which says how far that got.

    The drive's keyframes are those from ``first`` on, of all at ``poses`` (K, 3). For each in turn,
    ``places`` yields a candidate pose (3,) on the earlier map, or None if unknown; it is consumed only as far
    as needed. If ``is_given``, the user stated the place, and similar places elsewhere do not count against
    it.
    """
    known = [submap for submap in loops.history.submaps[:earlier] if submap.is_whole(loops.store)]
    pending = [submap for submap in loops.history.submaps[earlier:] if submap.is_whole(loops.store)]
    recognition = Recognition(poses, first, is_given, is_too_short=len(pending) < _MIN_SUPPORT)
    tried: list[Submap] = []
    rival_places = RivalPlaces(loops, known, poses)
    for keyframe, place in enumerate(places, start=first):
        if place is None:
            continue
        recognition.last_known, recognition.last_place = keyframe, place
        passed = [submap for submap in pending if submap.last <= keyframe]
        if not passed:
            continue
        pending = pending[len(passed) :]
        moved = poses.copy()
        moved[first:] = compose(compose(place, inverse(poses[keyframe])), poses[first:])
        passed = _recent(passed, keyframe, loops)
        for submap in passed:
            recognition.found += _verified(loops, submap, known, moved)
        tried = _recent([*tried, *passed], keyframe, loops)
        supported = _largest_group(loops, recognition.found, poses)
        support = _support(supported)
        if support < max(_MIN_SUPPORT, _VERIFIED_SHARE * len(tried)):
            continue
        if not is_given:
            recognition.rivals = rival_places.of(supported)
        rival_support = _support(_largest_group(loops, recognition.rivals, poses))
        if support >= _CLEAR_MAJORITY * rival_support:
            return supported
    raise recognition.failure(loops.history.graph.path)


def _recent(submaps: list[Submap], keyframe: int, loops: LoopCloser) -> list[Submap]:
    """Those so close along the path that the drive may be taken as rigid from there to the keyframe."""
    path = loops.history.graph.path
    return [submap for submap in submaps if path[keyframe] - path[submap.middle] < MAX_SPACING]


def _verified(loops: LoopCloser, moving: Submap, known: list[Submap], poses: Pose) -> list[Hypothesis]:
    """Hypothesis of a submap on the nearest known one that does not refute it, if any, given approximate
    keyframe ``poses`` (K, 3)."""
    for fixed in _nearest(moving, known, poses):
        hypothesis = loops.search_in(fixed, moving, poses, WITHOUT_DRIFT)
        if hypothesis is not None:
            return [hypothesis]
    return []


def _nearest(moving: Submap, known: list[Submap], poses: Pose) -> list[Submap]:
    """The nearest submaps that may show the same walls, by distance and rotation."""
    if not known:
        return []
    apart = between(poses[moving.middle], poses[[submap.middle for submap in known]])
    distances = np.hypot(apart[:, 0], apart[:, 1])
    order = np.argsort(distances + _METRES_PER_RADIAN * np.abs(apart[:, 2]), kind="stable")
    return [known[k] for k in order.tolist() if distances[k] < _FARTHEST][:_TRIED]


def _largest_group(loops: LoopCloser, found: list[Hypothesis], poses: Pose) -> list[Hypothesis]:
    """The largest set of consistent hypotheses."""
    graph = loops.history.graph
    groups = [[g for g in found if g is h or are_consistent(g, h, graph, poses)] for h in found]
    return max(groups, key=_support, default=[])


def _support(group: list[Hypothesis]) -> int:
    return len({hypothesis.moving.middle for hypothesis in group})
