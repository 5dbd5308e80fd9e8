"""Do different passes through a place agree on what is there?

A return that a scan of another pass looks through, or a wall that the other pass saw elsewhere, shows that
one of the two lies wrong. What neighbours along the path look through of each other shows how much of that
is usual with this sensor and this place: legs of people, glass, edges.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from racecar.mapping.matching.scan_matching import match, one_to_one
from racecar.mapping.matching.scan_store import ScanStore
from racecar.mapping.matching.see_through import see_through_each
from racecar.mapping.quality.config import PassAgreementConfig
from racecar.mapping.quality.finished_map import FinishedMap
from racecar.maps.geometry.se2 import Pose, between, wrap_angle


@dataclass(frozen=True, eq=False)
class PassAgreement:
    """P pairs of keyframes that are near each other in the map."""

    pairs: NDArray[np.int64]
    """(P, 2)"""
    looked_through: NDArray[np.float64]
    """(P,) share of the judged returns that the other scan looks through."""
    judged: NDArray[np.int64]
    """(P,) returns that could be judged."""
    walls_apart: NDArray[np.float64]
    """(P,) metres that walls move, root mean square, when the two scans are matched anew; NaN where they do
    not match."""

    def by_places(self, path: NDArray[np.float64], length: float) -> "PlacePairs":
        """The same by pairs of places: parts of a path (K,) of ``length`` metres each."""
        parts = np.floor(path[self.pairs] / length).astype(np.int64)
        places, of_pair = np.unique(parts, axis=0, return_inverse=True)
        of_pair = of_pair.reshape(-1)
        judged, through = np.zeros(len(places)), np.zeros(len(places))
        np.add.at(judged, of_pair, self.judged)
        np.add.at(through, of_pair, self.looked_through * self.judged)
        return PlacePairs(of_pair, through / np.maximum(judged, 1.0), judged)


@dataclass(frozen=True, eq=False)
class PlacePairs:
    """B pairs of places that different passes saw."""

    of_pair: NDArray[np.int64]
    """(P,) to which of them each pair of keyframes belongs."""
    looked_through: NDArray[np.float64]
    """(B,) share of the returns that could be judged."""
    judged: NDArray[np.float64]
    """(B,) returns that could be."""


def agreement_of(
    pairs: NDArray[np.int64], poses: Pose, store: ScanStore, config: PassAgreementConfig
) -> PassAgreement:
    """How the scans of pairs (P, 2) of keyframes at (K, 3) agree."""
    first, second = poses[pairs[:, 0]], poses[pairs[:, 1]]
    tally = see_through_each(store, pairs, first, second)
    judged = tally[:, 0] + tally[:, 1]
    looked_through = tally[:, 1] / np.maximum(judged, 1)
    return PassAgreement(pairs, looked_through, judged, _walls_apart(pairs, poses, store, config))


def _walls_apart(
    pairs: NDArray[np.int64], poses: Pose, store: ScanStore, config: PassAgreementConfig
) -> NDArray[np.float64]:
    apart = np.full(len(pairs), np.nan)
    between_them = between(poses[pairs[:, 0]], poses[pairs[:, 1]])
    faces_alike = np.flatnonzero(
        (np.hypot(between_them[:, 0], between_them[:, 1]) < config.match_reach)
        & (np.abs(wrap_angle(between_them[:, 2])) < config.match_turn)
    )
    if len(faces_alike) == 0:
        return apart
    guesses, pairings = between_them[faces_alike], one_to_one(pairs[faces_alike])
    # With the usual narrow kernel a wall that lies far off its partner would count next to nothing.
    roughly = match(
        guesses,
        pairings,
        store,
        store,
        initial_distance=config.match_distance,
        kernel_width=config.match_distance / 2.0,
    )
    matches = match(roughly.poses, pairings, store, store)
    moved = between(guesses, matches.poses)
    squared = np.einsum("pi,pij,pj->p", moved, matches.hessians, moved) / np.maximum(matches.weight, 1e-9)
    fits = (matches.overlap > config.min_overlap) & (matches.weight > 0)
    apart[faces_alike[fits]] = np.sqrt(np.maximum(squared[fits], 0.0))
    return apart


def pairs_of_passes(map_: FinishedMap, config: PassAgreementConfig) -> NDArray[np.int64]:
    """(P, 2) keyframes near each other whose paths lie far apart, evenly over the map."""
    chosen = _chosen(map_, config)
    pairs = cKDTree(map_.poses[chosen, :2]).query_pairs(config.reach, output_type="ndarray")
    pairs = chosen[np.sort(pairs, axis=1)]
    driven = map_.path[pairs[:, 1]] - map_.path[pairs[:, 0]]
    return _thinned(pairs[driven > config.apart], config.max_pairs)


def pairs_of_neighbours(map_: FinishedMap, config: PassAgreementConfig) -> NDArray[np.int64]:
    """(P, 2) keyframes that follow each other within a short way."""
    kept = np.flatnonzero(map_.session.keyframes.is_kept)
    pairs = np.concatenate([np.column_stack([kept[:-back], kept[back:]]) for back in (1, 2, 4)])
    driven = map_.path[pairs[:, 1]] - map_.path[pairs[:, 0]]
    return _thinned(pairs[(driven < config.neighbours) & (driven > 0.0)], config.max_neighbours)


def _chosen(map_: FinishedMap, config: PassAgreementConfig) -> NDArray[np.int64]:
    kept = np.flatnonzero(map_.session.keyframes.is_kept)
    return _thinned(kept, config.max_keyframes)


def _thinned(rows: NDArray[np.int64], most: int) -> NDArray[np.int64]:
    """Some rows (N, ...), evenly; at most so many."""
    if len(rows) <= most:
        return rows
    return rows[np.linspace(0, len(rows) - 1, most).astype(np.int64)]
