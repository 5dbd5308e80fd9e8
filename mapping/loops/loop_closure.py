"""Loop closure: find the places that the car has been to before.

Each submap is sought among the earlier ones that lie, for all that is known, within reach. What is found
is a hypothesis, kept open until its neighbours along the path tell the same story.
"""

from array import array
from bisect import bisect_left, bisect_right, insort
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import islice

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from racecar.mapping.arrays import Arrays
from racecar.mapping.graph.coarse_graph import Groups
from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.loops.submap import HALF_LENGTH, SPACING, Submap
from racecar.mapping.matching.correlative_search import Fit, LikelihoodPyramid, Window, search
from racecar.mapping.matching.match_information import match_information
from racecar.mapping.matching.scan_matching import Pairings, match
from racecar.mapping.matching.scan_store import ScanStore
from racecar.mapping.matching.see_through import see_through
from racecar.maps.geometry.se2 import Pose, between, compose

DRIFT_PER_METRE = 0.04
TURN_PER_METRE = np.deg2rad(0.06)
UNTIED = 60.0
"""Metres of drift that a keyframe stands for which only dead reckoning ties to those before."""
BASE_REACH = 0.5
BASE_TURN = np.deg2rad(4.0)
MAX_REACH = 20.0
MAX_TURN = np.deg2rad(40.0)
MIN_GRAPH_DISTANCE = 15.0
CANDIDATES = 4
CANDIDATE_SPACING = 3.0
MIN_SCORE = 0.5
RIVAL_SHARE = 0.85
LIKELY_SHARE = 0.25
"""Of the reach: so far off a place usually is, and a place found farther off must fit far better."""
NEAR_SHARE = 0.65
MIN_AGREEMENT = 0.85
MIN_COVERAGE = 0.4
MAX_RESIDUAL = 0.04
MAX_PAIRS = 40
ROUGH_KERNEL_WIDTH = 0.1
ROUGH_EVERY = 4
"""Of the pairs of scans, those that are matched roughly first."""
PYRAMID_RADIUS = 25.0
MOVING_POINTS = 500
AGREE_DISTANCE = 0.35
AGREE_ANGLE = np.deg2rad(2.5)
AGREE_WITHIN = 14.0
METRES_PER_WITNESS = 4.0
WITNESSES_WITHIN = 60.0


@dataclass(eq=False)
class Hypothesis:
    """A loop closure that was found and verified, but may still be a look-alike."""

    fixed: Submap
    moving: Submap
    fixed_from_moving: Pose
    """(3,) between the middles of both."""
    information: NDArray[np.float64]
    reach: float
    """Metres that were searched to find it: the wider, the more witnesses it needs."""
    accepted: bool = False


@dataclass(eq=False)
class LoopCloser:
    """Keeps the submaps, the hypotheses, and the graph of distances between submaps."""

    store: ScanStore
    verify: bool = True
    submaps: list[Submap] = field(default_factory=list)
    hypotheses: list[Hypothesis] = field(default_factory=list)
    """In the order of their moving submaps."""
    path: "array[float]" = field(default_factory=lambda: array("d"))
    """(K,) metres driven up to each keyframe."""
    doubt: "array[float]" = field(default_factory=lambda: array("d"))
    """(K,) the same, with each keyframe that scans do not tie counted as many metres more."""
    log: dict[str, int] = field(default_factory=dict)
    _edges: "array[float]" = field(default_factory=lambda: array("d"))
    """Submap, submap and metres of doubt between them, flat: it grows all day and is read at each submap."""
    _pyramids: dict[int, LikelihoodPyramid] = field(default_factory=dict)

    def add_keyframe(self, distance: float, *, is_tied: bool = True) -> Submap | None:
        """Note a keyframe ``distance`` metres after the last; returns the submap that it completes.

        ``is_tied`` tells whether scan matching ties it to the keyframes before.
        """
        self.path.append((self.path[-1] + distance) if self.path else 0.0)
        self.doubt.append((self.doubt[-1] if self.doubt else 0.0) + distance + (0.0 if is_tied else UNTIED))
        last = len(self.path) - 1
        path = np.array(self.path[max(0, last - 2000) :])
        offset = max(0, last - 2000)
        next_middle = (self.path[self.submaps[-1].middle] + SPACING) if self.submaps else HALF_LENGTH
        if self.path[last] < next_middle + HALF_LENGTH:
            return None
        middle = int(np.searchsorted(path, next_middle)) + offset
        first = int(np.searchsorted(path, self.path[middle] - HALF_LENGTH)) + offset
        n = len(self.submaps)
        submap = Submap(n, first, middle, last)
        if self.submaps:
            self._edges.extend((n - 1, n, self.doubt[middle] - self.doubt[self.submaps[-1].middle]))
        self.submaps.append(submap)
        return submap

    def frozen(self) -> "LoopCloser":
        """The same as it is now, to be told of and not to be gone on with."""
        hypotheses = [replace(each) for each in self.hypotheses]
        copies = LoopCloser(self.store, self.verify, list(self.submaps), hypotheses)
        copies.path, copies.doubt, copies.log = self.path[:], self.doubt[:], dict(self.log)
        copies._edges = self._edges[:]
        return copies

    def forget_pyramids(self) -> None:
        """Forget what `to_arrays` does not tell; it is made anew when needed."""
        self._pyramids.clear()

    def to_arrays(self) -> Arrays:
        """All there is to know; right after `forget_pyramids` another goes on from it exactly."""
        found = self.hypotheses
        ends = [[h.fixed.index, h.moving.index] for h in found]
        return {
            "submaps": np.array([[s.first, s.middle, s.last] for s in self.submaps], np.int32).reshape(-1, 3),
            "path": np.array(self.path),
            "doubt": np.array(self.doubt),
            "edges": np.array(self._edges).reshape(-1, 3),
            "hypothesis_submaps": np.array(ends, dtype=np.int32).reshape(-1, 2),
            "hypothesis_poses": np.array([h.fixed_from_moving for h in found]).reshape(-1, 3),
            "hypothesis_information": np.array([h.information for h in found]).reshape(-1, 3, 3),
            "hypothesis_reaches": np.array([h.reach for h in found]),
            "hypothesis_accepted": np.array([h.accepted for h in found], dtype=np.bool_),
            "log_names": np.array(list(self.log), dtype=np.str_),
            "log_counts": np.array(list(self.log.values()), dtype=np.int64),
        }

    @classmethod
    def from_arrays(cls, arrays: Arrays, store: ScanStore, *, verify: bool) -> "LoopCloser":
        """Loop closure over the keyframes of ``store`` that goes on from where another was."""
        submaps = [Submap(k, *row) for k, row in enumerate(arrays["submaps"].tolist())]
        closer = cls(store, verify, submaps)
        closer.path = array("d", arrays["path"].tolist())
        closer.doubt = array("d", arrays["doubt"].tolist())
        closer.log = dict(zip(arrays["log_names"].tolist(), arrays["log_counts"].tolist(), strict=True))
        closer._edges = array("d", arrays["edges"].ravel())
        for ends, pose, information, reach, accepted in zip(
            arrays["hypothesis_submaps"].tolist(),
            arrays["hypothesis_poses"].astype(np.float64),
            arrays["hypothesis_information"].astype(np.float64),
            arrays["hypothesis_reaches"].tolist(),
            arrays["hypothesis_accepted"].tolist(),
            strict=True,
        ):
            fixed, moving = (closer.submaps[k] for k in ends)
            closer.hypotheses.append(Hypothesis(fixed, moving, pose, information, reach, accepted))
        return closer

    def followed_by(self, later: "LoopCloser", store: ScanStore) -> "LoopCloser":
        """Both over ``store``, which holds the keyframes of the later one after those of this one. Nothing
        connects them yet, and neither brings its hypotheses."""
        keyframes, submaps = len(self.path), len(self.submaps)
        moved = [
            Submap(submaps + s.index, keyframes + s.first, keyframes + s.middle, keyframes + s.last)
            for s in later.submaps
        ]
        both = LoopCloser(store, later.verify, [*self.submaps, *moved])
        driven = self.path[-1] if self.path else 0.0
        both.path = array("d", [*self.path, *(driven + metres for metres in later.path)])
        doubted = self.doubt[-1] if self.doubt else 0.0
        both.doubt = array("d", [*self.doubt, *(doubted + UNTIED + metres for metres in later.doubt)])
        shifted = np.reshape(later._edges, (-1, 3)) + np.array([submaps, submaps, 0.0])
        both._edges = array("d", [*self._edges, *shifted.ravel()])
        return both

    def close(self, poses: Pose) -> list[Constraint]:
        """Seek the newest submap among the earlier ones; returns the loop closures that this settles."""
        newest = len(self.submaps) - 1
        return self.seek(newest, newest, poses)

    def seek(self, query: int, among: int, poses: Pose) -> list[Constraint]:
        """Seek a submap among the first so many; returns the loop closures that this settles."""
        for index, reach, turn in self._candidates(query, among, poses):
            hypothesis = self._try(self.submaps[index], self.submaps[query], poses, reach, turn)
            if hypothesis is not None:
                insort(self.hypotheses, hypothesis, key=lambda h: h.moving.index)
        return self.accept(self._settled(query, poses))

    def accept(self, hypotheses: Sequence[Hypothesis]) -> list[Constraint]:
        """Hold hypotheses for true; returns them as constraints."""
        for h in hypotheses:
            h.accepted = True
            self._edges.extend((h.fixed.index, h.moving.index, 0.1))
        return [
            Constraint(h.fixed.middle, h.moving.middle, h.fixed_from_moving, h.information, "loop_closure")
            for h in hypotheses
        ]

    def tied_until(self, loops: int) -> int:
        """The keyframe since which so many loops were closed; 0 while there were not so many."""
        accepted = (h.moving.first for h in reversed(self.hypotheses) if h.accepted)
        return next(islice(accepted, loops, None), 0)

    def groups(self) -> Groups:
        """Which submap each keyframe goes with."""
        return Groups(self._middles(), np.array(self.doubt))

    def are_near(
        self, first: NDArray[np.int64], second: NDArray[np.int64], doubt: float
    ) -> NDArray[np.bool_]:
        """(P, Q) whether keyframes (P,) and others (Q,) are tied by so many metres of doubt at most."""
        group = self.groups().nearest()
        submaps, which = np.unique(group[first], return_inverse=True)
        is_near: NDArray[np.bool_] = self._doubt_from(submaps, doubt) <= doubt
        return is_near[np.ix_(which, group[second])]

    def _doubt_from(self, submaps: NDArray[np.int64], most: float = np.inf) -> NDArray[np.float64]:
        """(Q, S) metres of doubt from some submaps (Q,) to each, infinite beyond the ``most`` sought."""
        n = len(self.submaps)
        edges = np.reshape(self._edges, (-1, 3))
        graph = csr_array((edges[:, 2], (edges[:, 0].astype(int), edges[:, 1].astype(int))), shape=(n, n))
        distances: NDArray[np.float64] = dijkstra(graph, directed=False, indices=submaps, limit=most)
        return distances

    def is_whole(self, submap: Submap) -> bool:
        """Are all its keyframes held?"""
        return bool(self.store.is_held[submap.first : submap.last + 1].all())

    def _middles(self) -> NDArray[np.int64]:
        return np.array([submap.middle for submap in self.submaps])

    def _count(self, what: str) -> None:
        self.log[what] = self.log.get(what, 0) + 1

    def _candidates(self, query: int, among: int, poses: Pose) -> list[tuple[int, float, float]]:
        if among == 0:
            return []
        distances = self._doubt_from(np.array([query]))[0, :among]
        middles = self._middles()
        apart = np.hypot(*(poses[middles[:among], :2] - poses[middles[query], :2]).T)
        reach = np.minimum(BASE_REACH + DRIFT_PER_METRE * distances, MAX_REACH)
        turn = np.minimum(BASE_TURN + TURN_PER_METRE * distances, MAX_TURN)
        chosen: list[tuple[int, float, float]] = []
        possible = (distances > MIN_GRAPH_DISTANCE) & (apart < reach + 2.0)
        # A place seen in many passes needs one candidate of it, the nearest.
        for index in np.argsort(np.where(possible, apart, np.inf), kind="stable"):
            if not possible[index] or len(chosen) == CANDIDATES:
                break
            if not self.is_whole(self.submaps[index]):
                continue
            here = poses[middles[index], :2]
            if all(np.hypot(*(poses[middles[c], :2] - here)) > CANDIDATE_SPACING for c, _, _ in chosen):
                chosen.append((int(index), float(reach[index]), float(turn[index])))
        return chosen

    def _pyramid(self, submap: Submap, poses: Pose) -> LikelihoodPyramid:
        if submap.index not in self._pyramids:
            if len(self._pyramids) >= 48:
                self._pyramids.pop(next(iter(self._pyramids)))
            self._pyramids[submap.index] = LikelihoodPyramid(submap.points(self.store, poses), PYRAMID_RADIUS)
        return self._pyramids[submap.index]

    def _try(
        self, fixed: Submap, moving: Submap, poses: Pose, reach: float, turn: float
    ) -> Hypothesis | None:
        points = moving.sample(self.store, poses, MOVING_POINTS)
        if points is None:
            return None
        guess = between(poses[fixed.middle], poses[moving.middle])
        self._count("searched")
        fit = self._search(self._pyramid(fixed, poses), points, guess, Window(reach, turn))
        if fit is None:
            return None
        return self.verified(fixed, moving, poses, fit.pose, reach)

    def _search(
        self, fixed: LikelihoodPyramid, points: NDArray[np.float64], guess: Pose, window: Window
    ) -> Fit | None:
        """The one place in the window where the points fit; None when there is none, or more than one.

        Drift seldom fills the window: a place near the guess wins against as good a one farther off, and one
        farther off must fit far better than any near.
        """
        near_window = Window(BASE_REACH + LIKELY_SHARE * (window.reach - BASE_REACH), window.turn)
        near = search(fixed, points, guess, near_window, MIN_SCORE, RIVAL_SHARE)
        floor = MIN_SCORE if near is None else min(near.score / RIVAL_SHARE, 1.0)
        far = search(fixed, points, guess, window, floor, RIVAL_SHARE)
        fit = near if far is None else far
        if fit is None:
            return None
        self._count("scored")
        beaten = near is not None and far is not None and near.score > NEAR_SHARE * far.score
        if beaten or fit.rival > 0.0:
            self._count("ambiguous")
            return None
        return fit

    def verified(
        self, fixed: Submap, moving: Submap, poses: Pose, guess: Pose, reach: float
    ) -> Hypothesis | None:
        """The hypothesis that a match from ``guess`` (3,) ends in; None when what scans look through refutes
        it."""
        fixed_poses, moving_poses = fixed.poses(poses), moving.poses(poses)
        a, b = nearest_pairs(fixed_poses, compose(guess, moving_poses), MAX_PAIRS)
        pairs = np.column_stack([fixed.keyframes[a], moving.keyframes[b]])

        def pairings(every: int) -> Pairings:
            taken = pairs[::every]
            starts = np.array([0, len(taken)])
            return Pairings(starts, taken, fixed_poses[a[::every]], moving_poses[b[::every]])

        # A wide kernel first: the search ends up to a cell off, and the narrow one would weigh away the walls
        # across a corridor, which alone tell the place along it. Some of the pairs suffice for that.
        rough = match(
            guess[None], pairings(ROUGH_EVERY), self.store, self.store, kernel_width=ROUGH_KERNEL_WIDTH
        )
        result = match(rough.poses, pairings(1), self.store, self.store, widest=0.2)
        pose = result.poses[0]
        test = see_through(self.store, pairs, fixed_poses[a], compose(pose, moving_poses[b]))
        if (
            result.residual[0] > MAX_RESIDUAL
            or test.agreement < MIN_AGREEMENT
            or test.coverage < MIN_COVERAGE
        ):
            self._count("refuted")
            return None
        self._count("verified")
        information = match_information(20.0 * result.hessians[0] / len(pairs), float(result.residual[0]))
        return Hypothesis(fixed, moving, pose, information, reach)

    def _settled(self, query: int, poses: Pose) -> list[Hypothesis]:
        now = self.path[self.submaps[query].last]

        def driven(h: Hypothesis) -> float:
            return self.path[h.moving.middle]

        first = bisect_right(self.hypotheses, now - WITNESSES_WITHIN, key=driven)
        end = bisect_left(self.hypotheses, now + WITNESSES_WITHIN, key=driven)
        recent = self.hypotheses[first:end]
        settled = []
        for h in recent:
            if h.accepted:
                continue
            witnesses = {g.moving.middle for g in recent if g is not h and self.agree(g, h, poses)}
            if not self.verify or len(witnesses) >= max(1.0, h.reach / METRES_PER_WITNESS):
                settled.append(h)
        return settled

    def agree(self, g: Hypothesis, h: Hypothesis, poses: Pose) -> bool:
        """Do two hypotheses of submaps not far apart along the path tell the same story?"""
        apart = abs(self.path[g.moving.middle] - self.path[h.moving.middle])
        if apart > AGREE_WITHIN or apart < 1.0:
            return False
        predicted = compose(
            compose(between(poses[g.fixed.middle], poses[h.fixed.middle]), h.fixed_from_moving),
            between(poses[h.moving.middle], poses[g.moving.middle]),
        )
        error = between(g.fixed_from_moving, predicted)
        return bool(np.hypot(error[0], error[1]) < AGREE_DISTANCE and abs(error[2]) < AGREE_ANGLE)


def nearest_pairs(first: Pose, second: Pose, most: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Indices (P,), (P,) of the pairs of poses that see most alike: near to each other and facing alike."""
    apart = np.hypot(*np.moveaxis(first[:, None, :2] - second[None, :, :2], -1, 0))
    turned = np.abs(np.angle(np.exp(1j * (first[:, None, 2] - second[None, :, 2]))))
    cost = (apart + 2.0 * turned).ravel()
    order = np.argsort(cost, kind="stable")[:most]
    a, b = np.unravel_index(order, apart.shape)
    return a, b
