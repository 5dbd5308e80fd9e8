"""Whether different passes through a place agree about it.

If a scan sees through a return of another pass, either is misplaced. How much neighbours along the path see
through each other, at the same distance of viewpoints, shows what is usual for this sensor and place: legs of
people, glass, edges.
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
"""Metres of path that form one place. Chosen by judgement: about what one scan sees well."""
_REACH = 4.0
"""Metres within which two keyframes see much of the same. Measured on 133 maps of known error."""
_APART = 5.0
"""Metres of path up to which two keyframes are neighbours, and beyond which they belong to different passes.
Chosen by judgement: drift is millimetres over it, and scans some metres apart have neighbours too."""
_MOST_KEYFRAMES = 1500
"""Keyframes compared at most, for time and memory. Chosen by judgement: every metre of a path of 1.5 km."""
_MOST_PASSES, _MOST_NEIGHBOURS = 1200, 600
"""Most pairs of passes and of neighbours, since more take longer. Chosen by judgement: 100 000 returns."""
_LEAST_JUDGED = 200
"""Judged returns that two passes need to disagree. Chosen by judgement: less than one scan has, so that a
passer-by's leg is not half of them."""
_FEW = 300.0
"""Weight of the overall share in a bin, in returns, because few returns do not show what is usual. Chosen by
judgement: one scan."""
_BINS = np.array([0.5, 1.0, 1.5, 2.0, 3.0])
"""Metres between two viewpoints at which bins begin, because the share seen through grows with the angle at
which both see an edge: up to 4 m in steps that hold about as many pairs each."""


@dataclass(frozen=True, eq=False)
class PassAgreement:
    """P pairs of keyframes that are close in the map."""

    pairs: NDArray[np.int64]
    """(P, 2)"""
    bins: NDArray[np.int64]
    """(P,) bin of the distance between their viewpoints, see `_BINS`."""
    looked_through: NDArray[np.int64]
    """(P,) returns that the other scan sees through."""
    judged: NDArray[np.int64]
    """(P,) returns that could be judged."""

    def usual(self, neighbours: "PassAgreement") -> NDArray[np.float64]:
        """(P,) returns that pairs would see through if they agreed as well as ``neighbours`` at the same
        distance of viewpoints."""
        count = len(_BINS) + 1
        judged = np.bincount(neighbours.bins, neighbours.judged, count)
        through = np.bincount(neighbours.bins, neighbours.looked_through, count)
        overall = through.sum() / max(judged.sum(), 1.0)
        share = (through + _FEW * overall) / (judged + _FEW)
        usual: NDArray[np.float64] = share[self.bins] * self.judged
        return usual

    def by_places(self, usual: NDArray[np.float64], path: NDArray[np.float64]) -> "PlacePairs":
        """Sums over pairs of places along a path (K,)."""
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
    """B pairs of places seen by different passes."""

    of_pair: NDArray[np.int64]
    """(P,) pair of places of each pair of keyframes."""
    looked_through: NDArray[np.float64]
    """(B,) share of judged returns that are seen through."""
    usual: NDArray[np.float64]
    """(B,) the same share between neighbours."""
    judged: NDArray[np.float64]
    """(B,) returns that could be judged."""

    @property
    def are_seen(self) -> NDArray[np.bool_]:
        """(B,) whether enough returns could be judged."""
        return self.judged > _LEAST_JUDGED


def agreement_of(pairs: NDArray[np.int64], poses: Pose, store: ScanStore) -> PassAgreement:
    """Agreement of the scans of pairs (P, 2) of keyframes at (K, 3)."""
    first, second = poses[pairs[:, 0]], poses[pairs[:, 1]]
    tally = see_through_each(store, pairs, first, second)
    metres = np.hypot(*(first - second)[:, :2].T)
    return PassAgreement(pairs, np.digitize(metres, _BINS), tally[:, 1], tally[:, 0] + tally[:, 1])


def near_pairs(map_: FinishedMap) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs of keyframes that see much of the same: (N, 2) neighbours along the path and (P, 2) of different
    passes, both evenly over the map."""
    kept = _thinned(np.flatnonzero(map_.session.keyframes.is_kept), _MOST_KEYFRAMES)
    found = cKDTree(map_.poses[kept, :2]).query_pairs(_REACH, output_type="ndarray")
    pairs = kept[np.sort(found, axis=1)]
    pairs = pairs[np.lexsort(pairs.T[::-1])]
    driven = map_.path[pairs[:, 1]] - map_.path[pairs[:, 0]]
    numbers = map_.session.times.numbers[pairs]
    are_passes = (driven > _APART) | (numbers[:, 0] != numbers[:, 1])
    return (
        _thinned(pairs[~are_passes & (driven > 0.0)], _MOST_NEIGHBOURS),
        _thinned(pairs[are_passes], _MOST_PASSES),
    )


def _thinned(rows: NDArray[np.int64], most: int) -> NDArray[np.int64]:
    """At most ``most`` of the rows (N, ...), evenly."""
    if len(rows) <= most:
        return rows
    return rows[np.linspace(0, len(rows) - 1, most).astype(np.int64)]
