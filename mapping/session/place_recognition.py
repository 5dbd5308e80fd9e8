"""Place recognition: find where a drive lies on an earlier map.

A few of its submaps are searched for on the whole map. Each place where one fits says where the whole drive
would lie; there it is placed, and the whole drive decides. Similar places agree in a few submaps, but seldom
all along.
"""

from collections.abc import Iterator

import numpy as np

from racecar.mapping.loops.submap import Submap
from racecar.mapping.session.drive_placement import DrivePlacer, Placement
from racecar.mapping.session.place_comparison import LEAST_METRES, PlaceComparison
from racecar.mapping.session.place_search import PlaceSearch, are_one_place
from racecar.mapping.session.session import Session
from racecar.mapping.session.unrecognized import Unrecognized
from racecar.maps.geometry.se2 import Pose, between, compose

_BITS = 3
"""Binary digits of the number of submaps searched for, 8, because of the time it takes: a drive that passes
the map on less of its way may not be recognized."""
_LEAST_SEARCHED = 4
"""Submaps searched for at least, because a rival place may score too little in some of them."""


def recognize(session: Session, first: int, start: Pose | None = None) -> Placement:
    """Place the drive of keyframes from ``first`` on, on the map of those before.

    If the pose (3,) of its first keyframe on the map is given as ``start``, similar places elsewhere do not
    count against it. Raises NotRecognizedError, which says how far that got.
    """
    store, poses, path = session.keyframes, session.map_from_keyframe, np.array(session.loops.graph.path)
    submaps = [submap for submap in session.loops.submaps if submap.is_whole(store)]
    own = [submap for submap in submaps if submap.first >= first]
    unrecognized = Unrecognized(session, first, float(path[-1] - path[first]), is_given=start is not None)
    if not own or unrecognized.metres < LEAST_METRES:
        raise unrecognized.as_too_short()
    search = PlaceSearch(store, [submap for submap in submaps if submap.first < first], poses)
    placer, found, stated = DrivePlacer(store, first, poses, path), list[Placement](), None
    if start is not None:
        for submap in own[:_LEAST_SEARCHED]:
            there = compose(start, between(poses[first], poses[submap.middle]))
            _place(found, placer, submap.middle, search.near(submap, there), first)
        if not found:
            raise unrecognized.as_found(None)
        stated = min(found, key=lambda each: each.contradicted)
    comparison = None
    for searched, submap in enumerate(_spread(own), start=1):
        _place(found, placer, submap.middle, search.anywhere(submap), first)
        if not found or searched < min(_LEAST_SEARCHED, len(own)):
            continue
        comparison = PlaceComparison(found, unrecognized.metres, stated)
        if comparison.is_certain:
            return placer.refined(comparison.best)
        if stated is not None:
            break
    raise unrecognized.as_found(comparison)


def _spread(own: list[Submap]) -> Iterator[Submap]:
    """Submaps spread over the drive, the more the longer one goes on."""
    count = min(len(own), 2**_BITS)
    order = sorted(range(2**_BITS), key=lambda k: f"{k:0{_BITS}b}"[::-1])
    return (own[k * len(own) // count] for k in order if k < count)


def _place(
    found: list[Placement], placer: DrivePlacer, keyframe: int, places: list[Pose], first: int
) -> None:
    """Place the drive where its keyframe lies at some places, unless it was before."""

    def is_new(pose: Pose) -> bool:
        return not any(are_one_place(other.poses[keyframe - first], pose) for other in found)

    for place in filter(is_new, places):
        placement = placer.place(keyframe, place)
        if placement is not None and is_new(placement.poses[keyframe - first]):
            found.append(placement)
