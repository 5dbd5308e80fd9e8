"""State of loop closure, as stored in a session: submaps, hypotheses, counts."""

from array import array
from bisect import bisect_left, bisect_right, insort
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.loops.hypothesis import Hypothesis
from racecar.mapping.loops.submap import Submap
from racecar.mapping.loops.submap_graph import SubmapGraph
from racecar.sensors.arrays import Arrays


@dataclass(eq=False)
class LoopHistory:
    """Submaps, hypotheses and counts of a drive so far."""

    graph: SubmapGraph = field(default_factory=SubmapGraph)
    hypotheses: list[Hypothesis] = field(default_factory=list)
    """In order of their moving submaps."""
    log: dict[str, int] = field(default_factory=dict)
    """Number of events by name."""

    @property
    def submaps(self) -> list[Submap]:
        """Submaps in order of the path."""
        return self.graph.submaps

    def count(self, what: str) -> None:
        """Increment the count of an event."""
        self.log[what] = self.log.get(what, 0) + 1

    def add(self, hypothesis: Hypothesis) -> None:
        """Insert a hypothesis in order."""
        insort(self.hypotheses, hypothesis, key=lambda h: h.moving.index)

    def within(self, metres: float, of: Submap) -> list[Hypothesis]:
        """Hypotheses whose moving submap is within this distance along the path of the end of a submap."""

        def driven(hypothesis: Hypothesis) -> float:
            return self.graph.path[hypothesis.moving.middle]

        now = self.graph.path[of.last]
        first = bisect_right(self.hypotheses, now - metres, key=driven)
        end = bisect_left(self.hypotheses, now + metres, key=driven)
        return self.hypotheses[first:end]

    def accept(self, hypotheses: Sequence[Hypothesis]) -> list[Constraint]:
        """Accept hypotheses; returns them as constraints."""
        for hypothesis in hypotheses:
            hypothesis.accepted = True
            self.graph.close(hypothesis.fixed, hypothesis.moving)
        return [hypothesis.as_constraint() for hypothesis in hypotheses]

    def first_free(self, loops: int) -> int:
        """First keyframe that the next loop still moves: at most ``loops`` loops were closed since."""
        accepted = (h.moving.first for h in reversed(self.hypotheses) if h.accepted)
        return next(islice(accepted, loops, None), 0)

    def frozen(self) -> "LoopHistory":
        """A snapshot that does not grow."""
        hypotheses = [replace(each) for each in self.hypotheses]
        return LoopHistory(self.graph.copy(), hypotheses, dict(self.log))

    def followed_by(self, later: "LoopHistory") -> "LoopHistory":
        """Concatenated submaps, see `SubmapGraph.followed_by`, without hypotheses."""
        return LoopHistory(self.graph.followed_by(later.graph))

    def with_tie(self, first: int, second: int) -> "LoopHistory":
        """A copy in which the submaps nearest to two keyframes are connected."""
        copy = self.frozen()
        if copy.submaps:
            ends = (copy.graph.submap_near(keyframe) for keyframe in (first, second))
            copy.graph.close(*(copy.submaps[k] for k in ends))
        return copy

    def without(self, ends: NDArray[np.int32]) -> "LoopHistory":
        """A copy without the loops between keyframes (N, 2)."""
        gone = {tuple(sorted(pair)) for pair in ends.tolist()}
        hypotheses = [
            h for h in self.hypotheses if tuple(sorted((h.fixed.middle, h.moving.middle))) not in gone
        ]
        return LoopHistory(self.graph.without(gone), hypotheses, dict(self.log))

    def only(self, remains: NDArray[np.bool_]) -> "LoopHistory":
        """The part for the remaining keyframes (K,), with submaps and hypotheses that are complete."""
        graph, number = self.graph.only(remains)
        hypotheses = [
            replace(each, fixed=graph.submaps[fixed], moving=graph.submaps[moving])
            for each in self.hypotheses
            if (fixed := number[each.fixed.index]) >= 0 and (moving := number[each.moving.index]) >= 0
        ]
        return LoopHistory(graph, hypotheses, dict(self.log))

    def to_arrays(self) -> Arrays:
        """The whole state, by the names documented in `Session`."""
        graph, found = self.graph, self.hypotheses
        submaps = [[s.first, s.middle, s.last] for s in graph.submaps]
        ends = [[h.fixed.index, h.moving.index] for h in found]
        return {
            "submaps": np.array(submaps, dtype=np.int32).reshape(-1, 3),
            "path": np.array(graph.path),
            "edges": np.array(graph.edges, dtype=np.int32).reshape(-1, 3),
            "variances": np.array(graph.variances).reshape(-1, 2),
            "hypothesis_submaps": np.array(ends, dtype=np.int32).reshape(-1, 2),
            "hypothesis_poses": np.array([h.fixed_from_moving for h in found]).reshape(-1, 3),
            "hypothesis_information": np.array([h.information for h in found]).reshape(-1, 3, 3),
            "hypothesis_reaches": np.array([h.reach for h in found]),
            "hypothesis_accepted": np.array([h.accepted for h in found], dtype=np.bool_),
            "log_names": np.array(list(self.log), dtype=np.str_),
            "log_counts": np.array(list(self.log.values()), dtype=np.int64),
        }

    @classmethod
    def from_arrays(cls, arrays: Arrays) -> "LoopHistory":
        """Rebuild from `to_arrays`. Raises KeyError when an array is missing."""
        submaps = [Submap(k, *row) for k, row in enumerate(arrays["submaps"].tolist())]
        path, variances = (array("d", arrays[name].ravel().tolist()) for name in ("path", "variances"))
        edges = array("l", arrays["edges"].ravel().tolist())
        hypotheses = [
            Hypothesis(submaps[fixed], submaps[moving], pose, information, reach, accepted)
            for (fixed, moving), pose, information, reach, accepted in zip(
                arrays["hypothesis_submaps"].tolist(),
                arrays["hypothesis_poses"].astype(np.float64),
                arrays["hypothesis_information"].astype(np.float64),
                arrays["hypothesis_reaches"].tolist(),
                arrays["hypothesis_accepted"].tolist(),
                strict=True,
            )
        ]
        log = dict(zip(arrays["log_names"].tolist(), arrays["log_counts"].tolist(), strict=True))
        return cls(SubmapGraph(submaps, path, edges, variances), hypotheses, log)
