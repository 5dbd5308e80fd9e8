"""Place recognition: does a drive lie on an earlier map where somebody found it?

Where the drive passed is found elsewhere, by whatever knows the earlier map; here it is verified as a loop
closure is. Each submap of the drive is matched, from where it was found, with those of the earlier map that
lie there. The place is believed once the hypotheses of several submaps are consistent, and nowhere else on
the map those of nearly as many are.
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
"""Metres that count as much as a radian between two submaps, in how alike their views are. By judgement, as
for pairs of scans."""
_FARTHEST = 6.0
"""Metres between the middles of two submaps that are matched. By judgement: as across a hall, where both see
the same walls."""
_TRIED = 4
"""Submaps of the earlier map on which one of the drive is tried, the likeliest first, because of the time it
takes."""
_MIN_SUPPORT = 2
"""Submaps whose hypotheses must be consistent. Measured on 42 pairs of recordings from different buildings,
never two were; drives of 10 m through a mapped room had so many."""
_VERIFIED_SHARE = 0.5
"""Share of the submaps last tried that they must be, because in another building some pass by chance, sooner
or later, and most of the right ones pass."""
_CLEAR_MAJORITY = 2
"""How many times as many submaps they must be as those of any other place, so that there is no doubt; by
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
    """Where the submaps after the first ``earlier`` ones lie on these: consistent hypotheses. Raises
    NotRecognizedError, which says how far that got.

    The drive's keyframes are those from ``first`` on, of all at ``poses`` (K, 3). For each of them in turn
    ``places`` says where (3,) on the earlier map it may lie; None where that is not known. No more of them
    are taken than are needed. Where somebody gave the place, ``is_given``, those that look alike elsewhere do
    not speak against it.
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
    """Those so near along the path that the drive may be taken as rigid from there to the keyframe."""
    path = loops.history.graph.path
    return [submap for submap in submaps if path[keyframe] - path[submap.middle] < MAX_SPACING]


def _verified(loops: LoopCloser, moving: Submap, known: list[Submap], poses: Pose) -> list[Hypothesis]:
    """The hypothesis of a submap on the nearest of the known ones on which it is not refuted, if any; the
    keyframes of both lie at ``poses`` (K, 3), about."""
    for fixed in _nearest(moving, known, poses):
        hypothesis = loops.seek_on(fixed, moving, poses, WITHOUT_DRIFT)
        if hypothesis is not None:
            return [hypothesis]
    return []


def _nearest(moving: Submap, known: list[Submap], poses: Pose) -> list[Submap]:
    """The nearest submaps that may show the same walls, by how far they lie away and are turned."""
    if not known:
        return []
    apart = between(poses[moving.middle], poses[[submap.middle for submap in known]])
    distances = np.hypot(apart[:, 0], apart[:, 1])
    order = np.argsort(distances + _METRES_PER_RADIAN * np.abs(apart[:, 2]), kind="stable")
    return [known[k] for k in order.tolist() if distances[k] < _FARTHEST][:_TRIED]


def _largest_group(loops: LoopCloser, found: list[Hypothesis], poses: Pose) -> list[Hypothesis]:
    """The consistent hypotheses of most submaps."""
    graph = loops.history.graph
    groups = [[g for g in found if g is h or are_consistent(g, h, graph, poses)] for h in found]
    return max(groups, key=_support, default=[])


def _support(group: list[Hypothesis]) -> int:
    return len({hypothesis.moving.middle for hypothesis in group})
