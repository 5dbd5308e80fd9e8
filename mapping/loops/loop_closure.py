"""Loop closure: recognize places that were visited before.

Each new submap is searched for in earlier ones that are within reach given the accumulated drift. The best
pose is refined by scan matching and verified by the see-through test. The resulting hypothesis becomes a
constraint once those of neighbouring submaps support it.
"""

from dataclasses import dataclass, field

import numpy as np

from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.graph.graph_edges import GraphEdges
from racecar.mapping.graph.pose_graph import PoseGraph
from racecar.mapping.loops.candidate_search import candidates
from racecar.mapping.loops.consistent_support import is_supported
from racecar.mapping.loops.hypothesis import Hypothesis
from racecar.mapping.loops.loop_history import LoopHistory
from racecar.mapping.loops.submap import Submap
from racecar.mapping.loops.submap_matching import LEAST_AGREEMENT, match_submaps
from racecar.mapping.loops.submap_search import SubmapSearch
from racecar.maps.geometry.se2 import Pose, between
from racecar.sensors.matching.correlative_search import Window
from racecar.sensors.matching.scan_store import ScanStore

_OPEN_DISTANCE = 60.0
"""Metres of path for which a hypothesis waits for support, because drift prevents it farther away; chosen by
judgement."""
_REACH_PER_METRE_OFF = 3.0
"""Metres of search window charged per metre between a hypothesis and its prediction, because fewer false
matches are closer; chosen by judgement."""


@dataclass(eq=False)
class LoopCloser:
    """Closes loops between the keyframes of a store."""

    store: ScanStore
    history: LoopHistory = field(default_factory=LoopHistory)
    least_agreement: float = LEAST_AGREEMENT
    """Share of judged points on surfaces, from which two submaps may show one place."""

    def __post_init__(self) -> None:
        self._search = SubmapSearch(self.store, self.history.count)

    def learn_drift(self, poses: Pose, graph: PoseGraph) -> None:
        """Update the uncertainty of the steps to the newest keyframes at ``poses`` (K, 3) from the pose
        graph; needed when a submap is complete."""
        known = self.history.graph.keyframes_with_variances
        steps = GraphEdges.of(graph.since(known), poses)
        self.history.graph.add_variances(steps.step_variances(known, len(poses)))

    def close(self, poses: Pose) -> list[Constraint]:
        """Search for the newest submap in earlier ones, with keyframes at ``poses`` (K, 3); returns loop
        closures accepted now."""
        newest = len(self.history.submaps) - 1
        return self.search(newest, newest, poses)

    def search(self, query: int, among: int, poses: Pose) -> list[Constraint]:
        """Search for a submap in the first ``among`` submaps; returns loop closures accepted now."""
        history, moving = self.history, self.history.submaps[query]
        for fixed, window in candidates(moving, among, history.graph, poses, self.store):
            hypothesis = self.search_in(fixed, moving, poses, window)
            if hypothesis is not None:
                history.add(hypothesis)
        near = history.within(_OPEN_DISTANCE, moving)
        open_ = [hypothesis for hypothesis in near if not hypothesis.accepted]
        return history.accept([each for each in open_ if is_supported(each, near, history.graph, poses)])

    def search_in(self, fixed: Submap, moving: Submap, poses: Pose, window: Window) -> Hypothesis | None:
        """Search for a submap in a window of a fixed one. None when it fits nowhere, or is ambiguous, or the
        scans refute it."""
        found = self._search.find(fixed, moving, poses, window)
        if found is None:
            return None
        expected = between(poses[fixed.middle], poses[moving.middle])
        off = float(np.hypot(*(found - expected)[:2])) * _REACH_PER_METRE_OFF
        return self.match(fixed, moving, poses, found, min(window.reach, off))

    def match(
        self, fixed: Submap, moving: Submap, poses: Pose, guess: Pose, reach: float
    ) -> Hypothesis | None:
        """Match two submaps from ``guess`` (3,), found within ``reach`` metres. Returns the hypothesis; None
        when the scans refute it."""
        matched = match_submaps(fixed, moving, poses, guess, self.store, self.least_agreement)
        self.history.count("refuted" if matched is None else "verified")
        return None if matched is None else Hypothesis(fixed, moving, *matched, reach)
