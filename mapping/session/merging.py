"""Merge sessions: recognize a later drive on an earlier map, and combine both in one graph."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from racecar.mapping.graph.constraint import Constraint, ConstraintList
from racecar.mapping.graph.pose_graph import PoseGraph
from racecar.mapping.keyframes.constraints import constrain
from racecar.mapping.keyframes.first_pass import pairs_with_first_pass
from racecar.mapping.loops.hypothesis import Hypothesis
from racecar.mapping.loops.loop_closure import LoopCloser
from racecar.mapping.session.measured import Measured
from racecar.mapping.session.place_recognition import recognize
from racecar.mapping.session.session import Session
from racecar.maps.geometry.se2 import Pose, compose, inverse
from racecar.sensors.matching.scan_store import ScanStore

FindPlaces: TypeAlias = Callable[[Session], Iterable[Pose | None]]
"""Yields a possible pose (3,) on the earlier map per keyframe of a session, in turn; None if unknown."""


@dataclass(frozen=True, eq=False)
class EarlierMap:
    """The map that a drive extends, and how to find the drive on it."""

    session: Session
    """The session of earlier drives."""
    find_places: FindPlaces
    """Proposes poses; each is verified before it is used."""
    is_start_given: bool = False
    """Whether the start of the drive is known, so that similar places do not matter."""


def merge(earlier: EarlierMap, later: Session, *, is_newer: bool = True) -> Session:
    """Merge both sessions in the frame of the earlier one, whose keyframes come first.

    Loops between them are closed as within a drive. Raises NotRecognizedError when the later one is not
    recognized on the earlier one. Where the world changed, a map that ``is_newer`` replaces the earlier one.
    """
    merged = _side_by_side(earlier.session, later, is_newer=is_newer)
    first, known = len(earlier.session.keyframes), len(earlier.session.loops.submaps)
    closer = LoopCloser(merged.keyframes, merged.loops)
    poses, places = merged.map_from_keyframe, earlier.find_places(later)
    recognized = recognize(closer, known, first, poses, places, is_given=earlier.is_start_given)
    merged.map_from_keyframe[first:] = _moved(merged.map_from_keyframe, first, recognized)
    joined = _close_loops(merged, first, known, recognized, closer)
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


def _moved(poses: Pose, first: int, recognized: list[Hypothesis]) -> Pose:
    """The poses (K, 3), those from ``first`` on moved by the median one of consistent hypotheses."""
    middle = recognized[len(recognized) // 2]
    map_from_moving = compose(poses[middle.fixed.middle], middle.fixed_from_moving)
    return compose(compose(map_from_moving, inverse(poses[middle.moving.middle])), poses[first:])


def _close_loops(
    merged: Session, first: int, known: int, recognized: list[Hypothesis], loops: LoopCloser
) -> Session:
    """Search for the submaps after the ``known`` ones in these, starting where the drive was recognized; then
    match keyframes from ``first`` on with earlier ones."""
    loops.history.hypotheses.extend(recognized)
    accepted = loops.history.accept(recognized)
    graph = _graph([*merged.constraints, *accepted])
    groups = loops.history.graph.groups()
    poses = graph.optimize_by_groups(merged.map_from_keyframe, groups)
    start = recognized[0].moving.index
    for query in sorted(range(known, len(loops.history.submaps)), key=lambda k: abs(k - start)):
        poses = graph.close(loops.search(query, known, poses), poses, groups)
    passes = pairs_with_first_pass(poses, loops.store.is_kept)
    between_drives = passes[(passes < first).sum(axis=1) == 1]
    matches = constrain(between_drives, poses, loops.store)
    graph = _graph([*graph.constraints, *matches])
    poses = graph.optimize_finally(poses)
    return replace(merged, map_from_keyframe=poses, constraints=graph.constraints)


def _graph(constraints: list[Constraint]) -> PoseGraph:
    return PoseGraph(sorted(constraints, key=lambda c: c.to_keyframe))
