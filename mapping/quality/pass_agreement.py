"""Do different passes through a place agree on what is there?

A return that a scan of another pass looks through shows that one of the two lies wrong. What neighbours along
the path look through of each other, from viewpoints as far apart, shows how much of that is usual with this
sensor and this place: legs of people, glass, edges.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from racecar.mapping.quality.finished_map import FinishedMap
from racecar.maps.geometry.se2 import Pose
from racecar.sensors.matching.scan_store import ScanStore
from racecar.sensors.matching.see_through import see_through_each

PLACE = 5.0
"""Metres of path that count as one place; by judgement, about what one scan sees well."""
_REACH = 4.0
"""Metres within which two keyframes see much of the same. Measured on 133 maps of known error."""
_APART = 5.0
"""Metres of path, up to which two keyframes are neighbours and beyond which they belong to different passes.
By judgement: drift is millimetres over it, and scans some metres apart have neighbours too."""
_MOST_KEYFRAMES = 1500
"""Keyframes that are compared at most, for time and memory; by judgement, every metre of a path of 1.5 km."""
_MOST_PASSES, _MOST_NEIGHBOURS = 1200, 600
"""Pairs of passes and of neighbours, since more take longer. By judgement: some 100 000 returns."""
_LEAST_JUDGED = 200
"""Returns that must be judged before two passes can contradict each other. By judgement: less than one scan
has, so that a leg of a passer-by is not the half of them."""
_FEW = 300.0
"""Returns of a bin beside which the share of all bins counts as much, because few returns tell little of how
much is usual; by judgement, one scan."""
_BINS = np.array([0.5, 1.0, 1.5, 2.0, 3.0])
"""Metres between two viewpoints, where what one scan looks through of another changes, because it grows with
the angle at which both see an edge: up to 4 m in steps that hold about as many pairs each."""


@dataclass(frozen=True, eq=False)
class PassAgreement:
    """P pairs of keyframes that are near each other in the map."""

    pairs: NDArray[np.int64]
    """(P, 2)"""
    bins: NDArray[np.int64]
    """(P,) how far their viewpoints lie apart, by `_BINS`."""
    looked_through: NDArray[np.int64]
    """(P,) returns that the other scan looks through."""
    judged: NDArray[np.int64]
    """(P,) returns that could be judged."""

    def usual(self, neighbours: "PassAgreement") -> NDArray[np.float64]:
        """(P,) returns that would be looked through if these pairs agreed as ``neighbours`` do whose
        viewpoints lie as far apart."""
        count = len(_BINS) + 1
        judged = np.bincount(neighbours.bins, neighbours.judged, count)
        through = np.bincount(neighbours.bins, neighbours.looked_through, count)
        overall = through.sum() / max(judged.sum(), 1.0)
        share = (through + _FEW * overall) / (judged + _FEW)
        usual: NDArray[np.float64] = share[self.bins] * self.judged
        return usual

    def by_places(self, usual: NDArray[np.float64], path: NDArray[np.float64]) -> "PlacePairs":
        """The same by pairs of places along a path (K,)."""
        parts = np.floor(path[self.pairs] / PLACE).astype(np.int64)
        places, of_pair = np.unique(parts, axis=0, return_inverse=True)
        of_pair = of_pair.reshape(-1)
        sums = np.zeros((len(places), 3))
        np.add.at(sums, of_pair, np.column_stack([self.judged, self.looked_through, usual]))
        judged, through, expected = sums.T
        most = np.maximum(judged, 1.0)
        return PlacePairs(of_pair, through / most, expected / most, judged)


@dataclass(frozen=True, eq=False)
class PlacePairs:
    """B pairs of places that different passes saw."""

    of_pair: NDArray[np.int64]
    """(P,) to which of them each pair of keyframes belongs."""
    looked_through: NDArray[np.float64]
    """(B,) share of the returns that could be judged."""
    usual: NDArray[np.float64]
    """(B,) the share that neighbours would look through of each other."""
    judged: NDArray[np.float64]
    """(B,) returns that could be."""

    @property
    def are_seen(self) -> NDArray[np.bool_]:
        """(B,) of which enough could be judged."""
        return self.judged > _LEAST_JUDGED


def agreement_of(pairs: NDArray[np.int64], poses: Pose, store: ScanStore) -> PassAgreement:
    """How the scans of pairs (P, 2) of keyframes at (K, 3) agree."""
    first, second = poses[pairs[:, 0]], poses[pairs[:, 1]]
    tally = see_through_each(store, pairs, first, second)
    metres = np.hypot(*(first - second)[:, :2].T)
    return PassAgreement(pairs, np.digitize(metres, _BINS), tally[:, 1], tally[:, 0] + tally[:, 1])


def near_pairs(map_: FinishedMap) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Keyframes that see much of the same: (N, 2) neighbours along the path and (P, 2) of different passes,
    both evenly over the map."""
    kept = _thinned(np.flatnonzero(map_.session.keyframes.is_kept), _MOST_KEYFRAMES)
    found = cKDTree(map_.poses[kept, :2]).query_pairs(_REACH, output_type="ndarray")
    pairs = kept[np.sort(found, axis=1)]
    pairs = pairs[np.lexsort(pairs.T[::-1])]
    driven = map_.path[pairs[:, 1]] - map_.path[pairs[:, 0]]
    are_passes = driven > _APART
    return (
        _thinned(pairs[~are_passes & (driven > 0.0)], _MOST_NEIGHBOURS),
        _thinned(pairs[are_passes], _MOST_PASSES),
    )


def _thinned(rows: NDArray[np.int64], most: int) -> NDArray[np.int64]:
    """Some rows (N, ...), evenly; at most so many."""
    if len(rows) <= most:
        return rows
    return rows[np.linspace(0, len(rows) - 1, most).astype(np.int64)]
