"""Loop closure: finds the places that the car has been to before.

Each new submap is sought on the earlier ones that lie, by the drift accumulated in between, within reach.
Where it fits, the two are matched; what no verifier refutes is a hypothesis, and it becomes a constraint once
no verifier leaves it open any more.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.graph.graph_edges import GraphEdges
from racecar.mapping.graph.pose_graph import PoseGraph
from racecar.mapping.loops.candidate_search import candidates
from racecar.mapping.loops.config import LoopClosureConfig
from racecar.mapping.loops.hypothesis import Hypothesis
from racecar.mapping.loops.loop_history import LoopHistory
from racecar.mapping.loops.submap import Submap
from racecar.mapping.loops.submap_matching import match_submaps
from racecar.mapping.loops.submap_search import SubmapSearch
from racecar.mapping.loops.verifier import LoopVerifier
from racecar.mapping.matching.correlative_search import Window
from racecar.mapping.matching.scan_store import ScanStore
from racecar.maps.geometry.se2 import Pose, between


@dataclass(eq=False)
class LoopCloser:
    """Closes loops between the keyframes of a store."""

    store: ScanStore
    config: LoopClosureConfig
    verifiers: Sequence[LoopVerifier]
    """None of them: whatever fits is a loop closure."""
    history: LoopHistory = field(default_factory=LoopHistory)

    def __post_init__(self) -> None:
        self._search = SubmapSearch(self.store, self.config, self.history.count)

    def add_keyframe(self, distance: float) -> Submap | None:
        """Note a keyframe ``distance`` metres after the last; returns the submap that it completes."""
        return self.history.graph.add_keyframe(distance, self.config.submaps)

    def learn_drift(self, poses: Pose, graph: PoseGraph) -> None:
        """Note how much the steps to the newest keyframes at ``poses`` (K, 3) may err, by the pose graph;
        wanted when a submap was completed."""
        known = self.history.graph.keyframes_with_variances
        steps = GraphEdges.of(graph.since(known), poses)
        self.history.graph.add_variances(steps.step_variances(known, len(poses)))

    def close(self, poses: Pose) -> list[Constraint]:
        """Seek the newest submap on the earlier ones, keyframes at ``poses`` (K, 3); returns the loop
        closures that are accepted now."""
        newest = len(self.history.submaps) - 1
        return self.seek(newest, newest, poses)

    def seek(self, query: int, among: int, poses: Pose) -> list[Constraint]:
        """Seek a submap on the first ``among`` submaps; returns the loop closures that are accepted now."""
        moving = self.history.submaps[query]
        for candidate in candidates(
            moving, among, self.history.graph, poses, self.is_whole, self.config.candidates
        ):
            hypothesis = self.seek_on(candidate.submap, moving, poses, candidate.window)
            if hypothesis is not None:
                self.history.add(hypothesis)
        return self.history.accept(self._confirmed(moving, poses))

    def seek_on(self, fixed: Submap, moving: Submap, poses: Pose, window: Window) -> Hypothesis | None:
        """The hypothesis that a submap lies within a window where it fits a fixed one; None when it fits
        nowhere, or in more than one place, or a verifier refutes it."""
        found = self._search.find(fixed, moving, poses, window)
        if found is None:
            return None
        expected = between(poses[fixed.middle], poses[moving.middle])
        support = self.config.consistent_support
        off = float(np.hypot(*(found - expected)[:2])) * support.reach_per_metre_off
        return self.match(fixed, moving, poses, found, min(window.reach, off))

    def match(
        self, fixed: Submap, moving: Submap, poses: Pose, guess: Pose, reach: float
    ) -> Hypothesis | None:
        """The hypothesis that a match from ``guess`` (3,), found within ``reach`` metres, ends in; None when
        the scans do not fit or a verifier refutes it."""
        match = match_submaps(fixed, moving, poses, guess, self.store, self.config.matching)
        if match is None or any(verifier.refutes(match, self.store) for verifier in self.verifiers):
            self.history.count("refuted")
            return None
        self.history.count("verified")
        return Hypothesis(fixed, moving, match.fixed_from_moving, match.information, reach)

    def is_whole(self, submap: Submap) -> bool:
        """Are the scans of all its keyframes kept?"""
        return submap.is_whole(self.store)

    def forget_pyramids(self) -> None:
        """Forget what `LoopHistory.to_arrays` does not hold, so that another goes on from it exactly."""
        self._search.forget_pyramids()

    def _confirmed(self, newest: Submap, poses: Pose) -> list[Hypothesis]:
        """Of the hypotheses near a submap along the path, those that no verifier leaves open any more."""
        near = self.history.within(self.config.open_distance, newest)
        return [
            hypothesis
            for hypothesis in near
            if not hypothesis.accepted
            and not any(
                verifier.leaves_open(hypothesis, near, self.history.graph, poses)
                for verifier in self.verifiers
            )
        ]
