"""The graph of submaps: how far each may have drifted relative to any other."""

from array import array
from collections.abc import Collection
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from racecar.mapping.graph.coarse_graph import Groups
from racecar.mapping.graph.contraction import inherited_links
from racecar.mapping.loops.submap import Submap
from racecar.maps.geometry.se2 import Pose

SPACING = 2.0
"""Metres of path between submaps, so that every place is near the centre of one; chosen by judgement."""
HALF_LENGTH = 3.0
"""Metres of path to each side of a submap's centre, chosen by judgement, because drift is negligible."""
_CLOSURE_VARIANCES = (0.03**2, 0.005**2)
"""Variances in square metres and radians after a loop closure. Chosen by judgement: half a cell of the map
and some tenths of a degree, because its submaps were matched."""
_BETWEEN_DRIVES = (100.0, 10.0)
"""The same between two drives: too large for any loop search, because their relative pose is unknown."""
_SEARCHED = 2000
"""Last keyframes among which the next submap is started, so that the cost stays constant all day."""


@dataclass(eq=False)
class SubmapGraph:
    """Submaps along the path, connected to their neighbours and by loop closures."""

    submaps: list[Submap] = field(default_factory=list)
    path: "array[float]" = field(default_factory=lambda: array("d"))
    """(K,) metres driven up to each keyframe."""
    edges: "array[int]" = field(default_factory=lambda: array("l"))
    """(E, 3) submap, submap, and whether a loop closure connects them; flat, because it is read for every
    submap."""
    variances: "array[float]" = field(default_factory=lambda: array("d"))
    """(V, 2) accumulated variances of the steps up to each keyframe, square metres and square radians; flat,
    up to the newest submap."""

    def add_keyframe(self, distance: float) -> Submap | None:
        """Add a keyframe ``distance`` metres after the last; returns the submap that it completes."""
        self.path.append((self.path[-1] + distance) if self.path else 0.0)
        last = len(self.path) - 1
        next_middle = (  # the first submap begins at its centre, so that the start is recognized too
            max(self.path[self.submaps[-1].middle] + SPACING, HALF_LENGTH) if self.submaps else 0.0
        )
        if self.path[last] < next_middle + HALF_LENGTH:
            return None
        offset = max(0, last - _SEARCHED)
        path = np.array(self.path[offset:])
        middle = int(np.searchsorted(path, next_middle)) + offset
        first = int(np.searchsorted(path, self.path[middle] - HALF_LENGTH)) + offset
        submap = Submap(len(self.submaps), first, middle, last)
        if self.submaps:
            self.edges.extend((submap.index - 1, submap.index, 0))
        self.submaps.append(submap)
        return submap

    @property
    def keyframes_with_variances(self) -> int:
        """Number of keyframes with known variances."""
        return len(self.variances) // 2

    def add_variances(self, of_steps: NDArray[np.float64]) -> None:
        """Append variances (N, 2) of the steps to the next keyframes: square metres, square radians."""
        before = self.variances[-2:] or [0.0, 0.0]
        self.variances.extend((np.cumsum(of_steps, axis=0) + before).ravel())

    def only(self, remains: NDArray[np.bool_]) -> "tuple[SubmapGraph, list[int]]":
        """The graph of the remaining keyframes (K,) with complete submaps, and the new index of each submap,
        -1 if it is incomplete."""
        before, keyframe = np.append(0, np.cumsum(remains)), np.cumsum(remains) - 1
        whole = [s for s in self.submaps if before[s.last + 1] - before[s.first] == s.last + 1 - s.first]
        number = np.full(len(self.submaps), -1)
        number[[s.index for s in whole]] = np.arange(len(whole))
        submaps = [
            Submap(k, int(keyframe[s.first]), int(keyframe[s.middle]), int(keyframe[s.last]))
            for k, s in enumerate(whole)
        ]
        edges = np.concatenate([_chain(len(whole)), self._closures_passed_on(number)])
        path, erred = np.array(self.path), np.reshape(self.variances, (-1, 2))
        graph = SubmapGraph(
            submaps,
            array("d", path[remains].tolist()),
            array("l", edges.ravel().tolist()),
            array("d", erred[remains[: len(erred)]].ravel().tolist()),
        )
        return graph, number.tolist()

    def _closures_passed_on(self, number: NDArray[np.int64]) -> NDArray[np.int64]:
        """(E, 3) closures between submaps with new indices (S,), not negative; those of a removed one pass on
        to a connected submap."""
        closed: dict[int, dict[int, bool]] = {k: {} for k in range(len(self.submaps))}
        for first, second, is_closure in np.reshape(self.edges, (-1, 3)).tolist():
            if is_closure or number[first] < 0 or number[second] < 0:
                closed[first][second] = closed[second][first] = True
        passed_on = inherited_links(
            closed, number >= 0, lambda going, other, _: (abs(other - going), other), lambda *_: True
        )
        pairs = [(number[first], number[second], 1) for first, second, _ in passed_on]
        return np.array(sorted(pairs), dtype=np.int64).reshape(-1, 3)

    def close(self, fixed: Submap, moving: Submap) -> None:
        """Connect two submaps by a loop closure."""
        self.edges.extend((fixed.index, moving.index, 1))

    def without(self, ends: Collection[tuple[int, ...]]) -> "SubmapGraph":
        """A copy without closures between submaps with these centres."""
        middles = self.middles()
        edges = np.reshape(self.edges, (-1, 3))
        pairs = np.sort(middles[edges[:, :2]], axis=1).tolist() if len(edges) else []
        stays = [
            not (edge[2] and tuple(pair) in ends) for edge, pair in zip(edges.tolist(), pairs, strict=True)
        ]
        left = edges[np.array(stays, dtype=np.bool_)] if len(edges) else edges
        return replace(self.copy(), edges=array("l", left.ravel().tolist()))

    def submap_near(self, keyframe: int) -> int:
        """Index of the submap whose centre is nearest to a keyframe."""
        return int(np.argmin(np.abs(self.middles() - keyframe)))

    def middles(self) -> NDArray[np.int64]:
        """(S,) centre keyframe of each submap."""
        return np.array([submap.middle for submap in self.submaps])

    def groups(self) -> Groups:
        """Assignment of keyframes to submaps."""
        drifted = np.reshape(self.variances, (-1, 2))[:, 0]
        after_the_last = len(self.path) - len(drifted)
        return Groups(self.middles(), np.pad(drifted, (0, after_the_last), mode="edge"))

    def spreads_from(
        self, submap: int, places: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(S,), (S,) standard deviations of one submap's position and heading relative to each other one, in
        metres and radians; submap centres are at ``places`` (S, 2)."""
        place, turn = self._edge_variances()
        seen_from = place + turn * self._squared_levers(submap, places)
        return self._along_chains(seen_from, submap), self._along_chains(turn, submap)

    def are_near(
        self, first: NDArray[np.int64], second: NDArray[np.int64], poses: Pose, most: float
    ) -> NDArray[np.bool_]:
        """(P, Q) whether keyframes (P,) and (Q,) at ``poses`` (K, 3) have a relative standard deviation of at
        most ``most`` metres."""
        group, places = self.groups().nearest(), poses[self.middles(), :2]
        submaps, which = np.unique(group[first], return_inverse=True)
        place, turn = self._edge_variances()
        spreads = [
            self._along_chains(place + turn * self._squared_levers(submap, places), submap, most)
            for submap in submaps.tolist()
        ]
        is_near: NDArray[np.bool_] = np.array(spreads) <= most
        return is_near[np.ix_(which, group[second])]

    def _edge_variances(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(E,), (E,) variances of each edge from the steps between: square metres, square radians."""
        first, second, is_closure = np.reshape(self.edges, (-1, 3)).T
        middles, accumulated = self.middles(), np.reshape(self.variances, (-1, 2))
        variances = np.abs(accumulated[middles[second]] - accumulated[middles[first]])
        variances[is_closure == 1] = _CLOSURE_VARIANCES
        return variances[:, 0], variances[:, 1]

    def _squared_levers(self, submap: int, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """(E,) squared lever arms in square metres, from a submap to each edge, of heading errors."""
        first, second, _ = np.reshape(self.edges, (-1, 3)).T
        levers = 0.5 * (places[first] + places[second]) - places[submap]
        return np.asarray(np.sum(levers**2, axis=1), dtype=np.float64)

    def _along_chains(
        self, variances: NDArray[np.float64], submap: int, most: float = np.inf
    ) -> NDArray[np.float64]:
        """(S,) standard deviations from a submap to each along the most certain path over edges with
        variances (E,); infinite beyond ``most``."""
        count = len(self.submaps)
        first, second, _ = np.reshape(self.edges, (-1, 3)).T
        graph = csr_array((variances, (first, second)), shape=(count, count))
        least: NDArray[np.float64] = dijkstra(
            graph, directed=False, indices=np.array([submap]), limit=most**2
        )
        return np.asarray(np.sqrt(least[0]), dtype=np.float64)

    def copy(self) -> "SubmapGraph":
        """A snapshot that does not grow."""
        return SubmapGraph(list(self.submaps), self.path[:], self.edges[:], self.variances[:])

    def followed_by(self, later: "SubmapGraph") -> "SubmapGraph":
        """Concatenate two graphs; the later one's keyframes and submaps are renumbered. Nothing connects them
        yet."""
        keyframes, submaps = len(self.path), len(self.submaps)
        moved = [
            Submap(submaps + s.index, keyframes + s.first, keyframes + s.middle, keyframes + s.last)
            for s in later.submaps
        ]
        driven = self.path[-1] if self.path else 0.0
        edges = np.reshape(later.edges, (-1, 3)) + np.array([submaps, submaps, 0])
        unknown = keyframes - self.keyframes_with_variances  # after the last submap of this one
        erred = self.variances[-2:] or array("d", [0.0, 0.0])
        later_erred = np.reshape(later.variances, (-1, 2)) + np.array(erred) + _BETWEEN_DRIVES
        return SubmapGraph(
            [*self.submaps, *moved],
            array("d", [*self.path, *(driven + metres for metres in later.path)]),
            array("l", [*self.edges, *edges.ravel().tolist()]),
            self.variances + unknown * erred + array("d", later_erred.ravel()),
        )


def _chain(count: int) -> NDArray[np.int64]:
    """(E, 3) edges between each of ``count`` submaps and the next."""
    numbers = np.arange(count)
    return np.column_stack([numbers[:-1], numbers[1:], np.zeros(max(count - 1, 0))]).astype(np.int64)
