"""Two sessions become one: the later drive finds its place on the earlier map, and one graph holds both."""

from dataclasses import replace

import numpy as np

from racecar.mapping.graph.constraint import Constraint, ConstraintList
from racecar.mapping.graph.pose_graph import PoseGraph
from racecar.mapping.keyframes.first_pass import pairs_with_first_pass
from racecar.mapping.keyframes.keyframe_tracking import constrain
from racecar.mapping.loops.loop_closure import Hypothesis
from racecar.mapping.matching.scan_store import ScanStore
from racecar.mapping.session.place_recognition import recognize
from racecar.mapping.session.session import Session
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose, compose, inverse


def join(earlier: Session, later: Session) -> Session:
    """Both sessions in the frame of the earlier one, whose keyframes come first.

    Raises UserError when the later one is not recognized anywhere on the earlier one.
    """
    joint = _side_by_side(earlier, later)
    first, known = len(earlier.keyframes), len(earlier.loops.submaps)
    story = recognize(joint.loops, known, joint.map_from_keyframe)
    if not story:
        raise UserError(
            "The drive was not recognized anywhere on the earlier map, so it cannot carry it on: map it on "
            "its own, or record one that passes some 10 m of where an earlier drive went."
        )
    joint.map_from_keyframe[first:] = _moved(joint.map_from_keyframe, first, story)
    return _close_loops(joint, first, known, story)


def _side_by_side(earlier: Session, later: Session) -> Session:
    """Both as one session, without a constraint between them and each in its own frame."""
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
        earlier.loops.followed_by(later.loops, keyframes),
    )


def _moved(poses: Pose, first: int, story: list[Hypothesis]) -> Pose:
    """The poses (K, 3) from ``first`` on, moved to where a story tells."""
    teller = story[len(story) // 2]
    map_from_moving = compose(poses[teller.fixed.middle], teller.fixed_from_moving)
    return compose(compose(map_from_moving, inverse(poses[teller.moving.middle])), poses[first:])


def _close_loops(joint: Session, first: int, known: int, story: list[Hypothesis]) -> Session:
    """Seek the submaps after the ``known`` ones among these, outwards from where the story was told; then tie
    the keyframes from ``first`` on to those before."""
    loops = joint.loops
    loops.hypotheses.extend(story)
    told = loops.accept(story)
    graph = _graph([*joint.constraints, *told])
    groups = loops.groups()
    poses = graph.optimize_by_groups(joint.map_from_keyframe, groups)
    start = story[0].moving.index
    for query in sorted(range(known, len(loops.submaps)), key=lambda k: abs(k - start)):
        poses = graph.close(loops.seek(query, known, poses), poses, groups)
    passes = pairs_with_first_pass(poses, loops.store.is_held)
    between_drives = passes[(passes < first).sum(axis=1) == 1]
    graph = _graph([*graph.constraints, *constrain(between_drives, poses, loops.store)])
    poses = graph.settle(poses)
    return replace(joint, map_from_keyframe=poses, constraints=graph.constraints)


def _graph(constraints: list[Constraint]) -> PoseGraph:
    return PoseGraph(sorted(constraints, key=lambda c: c.to_keyframe))
