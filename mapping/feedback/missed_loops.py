"""The loops that a drive missed, by what contradicts its map.

While the car drives, a place is sought in a window as wide as drift usually is, and a loop waits until as
many neighbours support it as a window of that width asks for. Where passes contradict each other in the
finished map, the window was too narrow or the support too scarce. So such passes are sought on each other in
a wide window, and hypotheses that still wait are tried with one supporter. Which of them are right shows in
the map that they lead to.
"""

from racecar.mapping.feedback.config import FeedbackConfig
from racecar.mapping.graph.pose_graph import PoseGraph
from racecar.mapping.loops.consistent_support import are_consistent
from racecar.mapping.loops.hypothesis import Hypothesis
from racecar.mapping.loops.loop_closure import LoopCloser
from racecar.mapping.loops.verifiers import verifiers
from racecar.mapping.matching.correlative_search import Window
from racecar.mapping.quality.map_quality import DoubtfulSegment, MapQuality, Verdict
from racecar.maps.geometry.se2 import Pose


def missed_loops(
    quality: MapQuality, poses: Pose, loops: LoopCloser, graph: PoseGraph, config: FeedbackConfig
) -> list[Hypothesis]:
    """Hypotheses that would change a map with keyframes at (K, 3), each supported by another one; none of a
    good map."""
    if quality.verdict == Verdict.GOOD:
        return []
    wide = LoopCloser(loops.store, config.loops, verifiers(config.loops), loops.history)
    found = [h for h in loops.history.hypotheses if not h.accepted]
    for segment in quality.segments:
        found += _between_passes(segment, poses, wide, config)
    found = [h for h in found if graph.is_strained_by(h.as_constraint(), poses)]
    limits, submaps = config.loops.consistent_support, loops.history.graph
    return [
        h for h in found if any(o is not h and are_consistent(o, h, submaps, poses, limits) for o in found)
    ]


def _between_passes(
    segment: DoubtfulSegment, poses: Pose, loops: LoopCloser, config: FeedbackConfig
) -> list[Hypothesis]:
    """Where a segment may lie on the one that contradicts it."""
    if segment.contradicted_by is None:
        return []
    submaps, path = loops.history.graph, loops.history.graph.path
    earlier, later = (path[sum(run) // 2] for run in (segment.contradicted_by, segment.keyframes))
    fixed, window = submaps.submap_about(earlier, config.loops.submaps), Window(config.reach, config.turn)
    moving = {submaps.submap_about(later + metres, config.loops.submaps) for metres in config.sought_at}
    found = [
        loops.seek_on(fixed, each, poses, window)
        for each in sorted(moving, key=lambda submap: submap.middle)
        if fixed.is_whole(loops.store) and each.is_whole(loops.store)
    ]
    return [h for h in found if h is not None]
