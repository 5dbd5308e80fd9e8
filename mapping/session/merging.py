"""Merge sessions: recognize a later drive on an earlier map, and combine both in one graph."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from racecar.mapping.graph.constraint import ConstraintList, in_order
from racecar.mapping.graph.pose_graph import PoseGraph
from racecar.mapping.keyframes.constraints import constrain
from racecar.mapping.keyframes.first_pass import pairs_with_first_pass
from racecar.mapping.loops.candidate_search import WITHOUT_DRIFT
from racecar.mapping.loops.hypothesis import Hypothesis
from racecar.mapping.loops.loop_closure import LoopCloser
from racecar.mapping.loops.submap_graph import SPACING
from racecar.mapping.loops.submap_matching import nearest_pairs
from racecar.mapping.session.measured import Measured
from racecar.mapping.session.place_recognition import recognize
from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import Pose, between, compose, inverse
from racecar.sensors.matching.scan_store import ScanStore


@dataclass(frozen=True, eq=False)
class EarlierMap:
    """The map that a drive extends."""

    session: Session
    """The session of earlier drives."""
    start: Pose | None = None
    """(3,) pose of the car on it at the start of the drive, if known."""


def merge(earlier: EarlierMap, later: Session, *, is_newer: bool = True) -> Session:
    """Merge both sessions in the frame of the earlier one, whose keyframes come first.

    Loops between them are closed as within a drive. Raises NotRecognizedError when the later one is not
    recognized on the earlier one. Where the world changed, a map that ``is_newer`` replaces the earlier one.
    """
    merged = _side_by_side(earlier.session, later, is_newer=is_newer)
    first, start = len(earlier.session.keyframes), earlier.start
    if start is not None:
        start = compose(start, inverse(later.keyframe_from_base[0]))
    placement = recognize(merged, first, start)
    merged.map_from_keyframe[first:] = placement.poses
    joined = _close_loops(merged, first, placement.least_agreement)
    return replace(joined, measured=_measured(earlier.session, later, joined))


def _side_by_side(earlier: Session, later: Session, *, is_newer: bool) -> Session:
    """Both as one session without constraints between them, each in its own frame."""
    first = len(earlier.keyframes)
    keyframes = ScanStore(first + len(later.keyframes))
    keyframes.extend(earlier.keyframes)
    keyframes.extend(later.keyframes)
    shifted = [
        replace(c, from_keyframe=c.from_keyframe + first, to_keyframe=c.to_keyframe + first)
        for c in later.constraints
    ]
    return Session(
        keyframes,
        [*earlier.rays, *later.rays],
        np.concatenate([earlier.keyframe_from_base, later.keyframe_from_base]),
        np.concatenate([earlier.map_from_keyframe, later.map_from_keyframe]),
        ConstraintList([*earlier.constraints, *shifted]),
        earlier.loops.followed_by(later.loops),
        earlier.times.followed_by(later.times, is_newer=is_newer),
    )


def _measured(earlier: Session, later: Session, joined: Session) -> Measured | None:
    """What was measured of both, and between them; None if neither was corrected by hand."""
    if earlier.measured is None and later.measured is None:
        return None
    first = len(earlier.keyframes)
    apart = _side_by_side(earlier.as_measured, later.as_measured, is_newer=True)
    joined_from_later = compose(joined.map_from_keyframe[first], inverse(later.map_from_keyframe[0]))
    poses = apart.map_from_keyframe
    poses[first:] = compose(joined_from_later, poses[first:])
    is_between = (joined.constraints.ends < first).sum(axis=1) == 1
    between_both = joined.constraints.chosen(np.flatnonzero(is_between))
    return Measured(poses, ConstraintList([*apart.constraints, *between_both]), "")


def _close_loops(merged: Session, first: int, least_agreement: float) -> Session:
    """Match submaps of the drive from keyframe ``first`` on with those of the map where it was placed, and
    search for the others from there; then match keyframes."""
    loops = LoopCloser(merged.keyframes, merged.loops, least_agreement)
    known = sum(submap.first < first for submap in merged.loops.submaps)
    found = list(_matched_where_placed(loops, known, merged.map_from_keyframe))
    loops.history.hypotheses.extend(found)
    graph = PoseGraph(in_order([*merged.constraints, *loops.history.accept(found)]))
    groups = loops.history.graph.groups()
    poses = graph.optimize_by_groups(merged.map_from_keyframe, groups)
    for query in range(known, len(loops.history.submaps)):
        poses = graph.close(loops.search(query, known, poses), poses, groups)
    passes = pairs_with_first_pass(poses, loops.store.is_kept)
    between_drives = passes[(passes < first).sum(axis=1) == 1]
    matches = constrain(between_drives, poses, loops.store)
    graph = PoseGraph(in_order([*graph.constraints, *matches]))
    poses = graph.optimize_finally(poses)
    return replace(merged, map_from_keyframe=poses, constraints=graph.constraints)


def _matched_where_placed(loops: LoopCloser, known: int, poses: Pose) -> Iterator[Hypothesis]:
    """Submaps after the first ``known`` ones, each matched with the one of these that sees most alike."""
    submaps = [submap for submap in loops.history.submaps if submap.is_whole(loops.store)]
    earlier = [submap for submap in submaps if submap.index < known]
    middles = poses[[submap.middle for submap in earlier]]
    for moving in submaps[len(earlier) :]:
        at = poses[moving.middle]
        nearest = int(nearest_pairs(middles, at[None], 1)[0][0])
        guess = between(middles[nearest], at)
        if np.hypot(*guess[:2]) < SPACING:
            fixed, reach = earlier[nearest], WITHOUT_DRIFT.reach
            found = loops.match(fixed, moving, poses, guess, reach)
            yield from () if found is None else (found,)
