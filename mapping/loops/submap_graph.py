"""The graph of submaps: how much drift may have accumulated between any two of them."""

from array import array
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from racecar.mapping.graph.coarse_graph import Groups
from racecar.mapping.loops.config import SubmapConfig
from racecar.mapping.loops.submap import Submap
from racecar.maps.geometry.se2 import Pose

_OF_A_CLOSURE = 0.1
"""Metres of accumulated drift that a loop closure leaves: next to none, because its submaps were matched."""
_CLOSURE_VARIANCES = (0.03**2, 0.005**2)
"""Square metres and radians that a loop closure leaves: by judgement, as much as half a cell of the map and
some tenths of a degree, because its submaps were matched."""
_SEARCHED = 2000
"""Keyframes at the end of the path in which the next submap begins, so that the search costs the same all
day."""


@dataclass(eq=False)
class SubmapGraph:
    """Submaps along the path, connected to their neighbours and by loop closures.

    Drift is counted in the metres driven that would accumulate as much of it.
    """

    submaps: list[Submap] = field(default_factory=list)
    path: "array[float]" = field(default_factory=lambda: array("d"))
    """(K,) metres driven up to each keyframe."""
    accumulated_drift: "array[float]" = field(default_factory=lambda: array("d"))
    """(K,) the same, each step that no scan match confirms counted as many more metres."""
    edges: "array[float]" = field(default_factory=lambda: array("d"))
    """Submap, submap and metres of accumulated drift between them, flat: it is read at each new submap."""
    variances: "array[float]" = field(default_factory=lambda: array("d"))
    """(V, 2) square metres and square radians that the steps up to each keyframe may err, added up, flat;
    known up to the newest submap."""

    def add_keyframe(
        self, distance: float, config: SubmapConfig, further_drift: float = 0.0, view: float = np.inf
    ) -> Submap | None:
        """Add a keyframe of a laser that sees ``view`` metres far, ``distance`` metres after the last, since
        when ``further_drift`` metres have accumulated besides; returns the submap that it completes."""
        drifted = self.accumulated_drift[-1] if self.accumulated_drift else 0.0
        self.path.append((self.path[-1] + distance) if self.path else 0.0)
        self.accumulated_drift.append(drifted + distance + further_drift)
        last = len(self.path) - 1
        spacing = min(config.spacing, config.spacing_per_view * view)
        next_middle = (  # the first is all ahead, so that the start is recognized too
            max(self.path[self.submaps[-1].middle] + spacing, config.half_length) if self.submaps else 0.0
        )
        if self.path[last] < next_middle + config.half_length:
            return None
        offset = max(0, last - _SEARCHED)
        path = np.array(self.path[offset:])
        middle = int(np.searchsorted(path, next_middle)) + offset
        first = int(np.searchsorted(path, self.path[middle] - config.half_length)) + offset
        submap = Submap(len(self.submaps), first, middle, last)
        if self.submaps:
            before = self.submaps[-1]
            since = self.accumulated_drift[middle] - self.accumulated_drift[before.middle]
            self.edges.extend((before.index, submap.index, since))
        self.submaps.append(submap)
        return submap

    def submap_about(self, metres: float, config: SubmapConfig) -> Submap:
        """A submap beside those of the path, about the keyframe that was reached after so many metres."""
        path = np.array(self.path)
        middle = min(int(np.searchsorted(path, metres)), len(path) - 1)
        first = int(np.searchsorted(path, path[middle] - config.half_length))
        end = int(np.searchsorted(path, path[middle] + config.half_length, side="right"))
        return Submap(-1, first, middle, end - 1)

    @property
    def keyframes_with_variances(self) -> int:
        """How many keyframes there are whose variances are known."""
        return len(self.variances) // 2

    def add_variances(self, of_steps: NDArray[np.float64]) -> None:
        """How much the steps (N, 2) to the next keyframes may err: square metres, square radians."""
        before = self.variances[-2:] or [0.0, 0.0]
        self.variances.extend((np.cumsum(of_steps, axis=0) + before).ravel())

    def close(self, fixed: Submap, moving: Submap) -> None:
        """Connect two submaps by a loop closure."""
        self.edges.extend((fixed.index, moving.index, _OF_A_CLOSURE))

    def middles(self) -> NDArray[np.int64]:
        """(S,) the middle keyframe of each submap."""
        return np.array([submap.middle for submap in self.submaps])

    def groups(self) -> Groups:
        """The submap that each keyframe moves with."""
        return Groups(self.middles(), np.array(self.accumulated_drift))

    def spreads_from(
        self, submap: int, places: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(S,), (S,) standard deviations of where and how one submap lies as seen from each, in metres and
        radians; the middles of all lie at ``places`` (S, 2).

        The variances of the steps between add up, those of turns times the square of their distance: what is
        seen from beyond a turn moves with it. Of several chains the surest counts.
        """
        edges = np.reshape(self.edges, (-1, 3))
        first, second = edges[:, :2].astype(int).T
        middles, accumulated = self.middles(), np.reshape(self.variances, (-1, 2))
        variances = np.abs(accumulated[middles[second]] - accumulated[middles[first]])
        variances[edges[:, 2] == _OF_A_CLOSURE] = _CLOSURE_VARIANCES
        place, turn = variances.T
        levers = 0.5 * (places[first] + places[second]) - places[submap]
        place = place + turn * np.sum(levers**2, axis=1)

        def spreads(variances: NDArray[np.float64]) -> NDArray[np.float64]:
            graph = csr_array((variances, (first, second)), shape=(len(places), len(places)))
            least: NDArray[np.float64] = dijkstra(graph, directed=False, indices=np.array([submap]))
            return np.asarray(np.sqrt(least[0]), dtype=np.float64)

        return spreads(place), spreads(turn)

    def are_near(
        self, first: NDArray[np.int64], second: NDArray[np.int64], poses: Pose, most: float
    ) -> NDArray[np.bool_]:
        """(P, Q) whether keyframes (P,) and (Q,), of all at ``poses`` (K, 3), lie as seen from each other
        with a standard deviation of ``most`` metres at most."""
        group, places = self.groups().nearest(), poses[self.middles(), :2]
        submaps, which = np.unique(group[first], return_inverse=True)
        spread = np.array([self.spreads_from(submap, places)[0] for submap in submaps.tolist()])
        is_near: NDArray[np.bool_] = spread <= most
        return is_near[np.ix_(which, group[second])]

    def copy(self) -> "SubmapGraph":
        """The same as it is now; it does not grow."""
        parts = self.path, self.accumulated_drift, self.edges, self.variances
        return SubmapGraph(list(self.submaps), *(part[:] for part in parts))

    def followed_by(self, later: "SubmapGraph", drift: float) -> "SubmapGraph":
        """Both, the keyframes and submaps of the later one numbered after those of this one; nothing connects
        them yet. Over the gap between the two ``drift`` metres have accumulated."""
        keyframes, submaps = len(self.path), len(self.submaps)
        moved = [
            Submap(submaps + s.index, keyframes + s.first, keyframes + s.middle, keyframes + s.last)
            for s in later.submaps
        ]
        driven = self.path[-1] if self.path else 0.0
        drifted = self.accumulated_drift[-1] if self.accumulated_drift else 0.0
        edges = np.reshape(later.edges, (-1, 3)) + np.array([submaps, submaps, 0.0])
        unknown = keyframes - self.keyframes_with_variances  # after the last submap of this one
        erred = self.variances[-2:] or array("d", [0.0, 0.0])
        later_erred = np.reshape(later.variances, (-1, 2)) + np.array(erred)
        return SubmapGraph(
            [*self.submaps, *moved],
            array("d", [*self.path, *(driven + metres for metres in later.path)]),
            array("d", [*self.accumulated_drift, *(drifted + drift + m for m in later.accumulated_drift)]),
            array("d", [*self.edges, *edges.ravel()]),
            self.variances + unknown * erred + array("d", later_erred.ravel()),
        )
