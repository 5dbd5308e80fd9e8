"""The loops that a drive missed, by what contradicts its map.

While the car drives, a place is sought in a window as wide as drift usually is, and a loop waits until as
many neighbours support it as a window of that width asks for. Where passes contradict each other in the
finished map, the window was too narrow or the support too scarce. So such passes are sought on each other in
a wide window, and hypotheses that still wait are tried with one supporter. Which of them are right shows in
the map that they lead to.
"""

from racecar.mapping.graph.pose_graph import are_strained
from racecar.mapping.loops.consistent_support import are_consistent
from racecar.mapping.loops.hypothesis import Hypothesis
from racecar.mapping.loops.loop_closure import LoopCloser
from racecar.mapping.quality.map_quality import DoubtfulSegment, MapQuality, Verdict
from racecar.maps.geometry.se2 import Pose
from racecar.sensors.matching.correlative_search import Window

FEEDBACK_ROUNDS = 3
"""How often a map is corrected and judged again at most, because each takes a final optimization."""
_WINDOW = Window(3.0, 0.5)
"""Metres and radians to each side within which a pass is searched for on one that contradicts it. By
judgement: passes are compared where they lie within 4 m of each other. Measured on a lab seen by a laser of
4 m: 0.3 rad after 22 m of path."""
_SOUGHT_AT = (-1.5, 0.0, 1.5)
"""Metres of path from the middle of a pass to the places from which it is searched for, so that they can
support each other; by judgement."""
_MIN_SCORE, _MIN_COVERAGE = 0.25, 0.25
"""Score and coverage that are asked for, because passes often have little in common where a loop was missed,
and the map that a wrong loop leads to refutes it. Measured on a lab seen by a laser of 4 m and on a piece of
intel with a hole: the drive's own limits find none of the loops that these find."""


def missed_loops(quality: MapQuality, poses: Pose, loops: LoopCloser) -> list[Hypothesis]:
    """Hypotheses that would change a map with keyframes at (K, 3), each supported by another one; none of a
    good map."""
    if quality.verdict == Verdict.GOOD:
        return []
    wide = LoopCloser(loops.store, loops.history, _MIN_SCORE, _MIN_COVERAGE)
    found = [h for h in loops.history.hypotheses if not h.accepted]
    for segment in quality.segments:
        found += _between_passes(segment, poses, wide)
    found = [h for h in found if are_strained([h.as_constraint()], poses)]
    submaps = loops.history.graph
    return [h for h in found if any(o is not h and are_consistent(o, h, submaps, poses) for o in found)]


def _between_passes(segment: DoubtfulSegment, poses: Pose, loops: LoopCloser) -> list[Hypothesis]:
    """Where a segment may lie on the one that contradicts it."""
    if segment.contradicted_by is None:
        return []
    submaps, path = loops.history.graph, loops.history.graph.path
    earlier, later = (path[sum(run) // 2] for run in (segment.contradicted_by, segment.keyframes))
    fixed = submaps.submap_about(earlier)
    moving = {submaps.submap_about(later + metres) for metres in _SOUGHT_AT}
    found = [
        loops.seek_on(fixed, each, poses, _WINDOW)
        for each in sorted(moving, key=lambda submap: submap.middle)
        if fixed.is_whole(loops.store) and each.is_whole(loops.store)
    ]
    return [h for h in found if h is not None]
