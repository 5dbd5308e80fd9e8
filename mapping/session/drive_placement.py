"""A whole drive placed on an earlier map, and how far both agree there.

From a guess of one keyframe's pose the drive is followed to both of its ends, by matching scans with those of
the map, as far as these reach. Then the see-through test counts, over the whole drive, what lies on surfaces
of the map and what contradicts them.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from racecar.mapping.keyframes.constraints import MAX_RESIDUAL, MIN_OVERLAP
from racecar.mapping.loops.submap_matching import nearest_pairs
from racecar.maps.geometry.se2 import IDENTITY, Pose, are_apart, between, compose
from racecar.sensors.matching.scan_matching import Pairings, match
from racecar.sensors.matching.scan_store import ScanStore
from racecar.sensors.matching.see_through import SeeThrough, see_through, see_through_each

_SPACING = 0.5
"""Metres of path between scans that are matched with the map. Chosen by judgement: a drive drifts little in
between, and long ones are placed in seconds."""
_NEAR = 4.0
"""Metres within which scans of the map are compared with one of the drive. Chosen by judgement: across a wide
corridor."""
_COMPARED = 4
"""Scans of the map compared with one of the drive at most, those with the most similar views, because of the
time it takes."""
_HELD = np.diag([200.0, 200.0, 2000.0])
"""Information of the prediction from the scan before, in numbers of matched points, so that a drive does not
slide along walls that do not hold it. Chosen by judgement: a tenth of what a scan has across a wall."""
_LARGEST_STEP = (0.3, math.radians(4.0))
"""Metres and radians by which a match may correct the prediction. Chosen by judgement: a cell of the search
that made the guess, and drift of both maps."""
_TRIAL = 20
"""Scans compared after which a hopeless place is given up, which saves most of the time. Chosen by judgement:
ten metres of path."""
_HOPELESS = 0.5
"""Agreement below which it is. Measured: right places have 0.9 in race halls, and 0.8 in a hall whose drives
face away from each other."""
_LEAST_AGREEMENT = 0.9
"""Agreement of drive and map from which they may show one place, relative to that of successive scans.
Measured on a few pairs: 0.98 of it and more in race halls, 0.92 where half of the furniture was moved."""


@dataclass(frozen=True, eq=False)
class Placement:
    """L keyframes of a drive, placed on an earlier map."""

    poses: Pose
    """(L, 3) on the earlier map."""
    shares: NDArray[np.float64]
    """(C,) share of points on surfaces of the map, of each keyframe compared; 0 off the map."""
    seen: SeeThrough
    """Counts over the whole drive."""
    usual: float
    """Share that successive scans contradict each other, in the drive or on the map, whichever is more: thin
    things, slanted beams and people make it so at the right place, too."""

    @property
    def explained(self) -> float:
        """Share of what the drive saw that lies on surfaces of the map."""
        return float(self.shares.mean())

    @property
    def contradicted(self) -> float:
        """Share of points seen through, of those that either can judge of the other."""
        return 1.0 - self.seen.agreement

    @property
    def least_agreement(self) -> float:
        """Agreement from which drive and map may show one place."""
        return _LEAST_AGREEMENT * (1.0 - self.usual)

    @property
    def agrees(self) -> bool:
        """Whether they may."""
        return self.seen.agreement >= self.least_agreement


class DrivePlacer:
    """Places a drive, of keyframes from ``first`` on, on the map of those before, all at ``poses`` (K, 3)."""

    def __init__(self, store: ScanStore, first: int, poses: Pose, path: NDArray[np.float64]) -> None:
        """``path`` (K,) metres driven up to each keyframe; some scan of the drive must be kept."""
        self._store, self._first, self._poses = store, first, poses
        self._fixed = np.flatnonzero(store.is_kept[:first])
        self._tree = cKDTree(poses[self._fixed, :2])
        kept = first + np.flatnonzero(store.is_kept[first:])
        _, begins = np.unique(np.floor(path[kept] / _SPACING), return_index=True)
        self._compared: NDArray[np.int64] = kept[begins]

    @cached_property
    def _usual(self) -> float:
        return 1.0 - min(self._neighbours(self._compared), self._neighbours(self._fixed))

    def place(self, keyframe: int, pose: Pose) -> Placement | None:
        """The drive if its ``keyframe`` lies at a pose (3,) on the map; None where that is hopeless."""
        compared, own = self._compared, self._poses
        start = int(np.argmin(np.abs(compared - keyframe)))
        placed, tallies = np.zeros((len(compared), 3)), np.zeros((len(compared), 3), dtype=np.int64)
        tried = 0
        for way in (range(start, len(compared)), range(start, -1, -1)):
            before, there = keyframe, pose
            for c in way:
                guess = compose(there, between(own[before], own[compared[c]]))
                placed[c], tallies[c] = self._compare(int(compared[c]), guess)
                before, there, tried = compared[c], placed[c], tried + 1
                if tried == _TRIAL and SeeThrough(*tallies.sum(axis=0).tolist()).agreement < _HOPELESS:
                    return None
        keyframes = np.arange(self._first, len(own))
        nearest = np.abs(keyframes[:, None] - compared).argmin(axis=1)
        poses = compose(placed[nearest], between(own[compared[nearest]], own[keyframes]))
        shares = tallies[:, 0] / np.maximum(tallies.sum(axis=1), 1)
        return Placement(poses, shares, SeeThrough(*tallies.sum(axis=0).tolist()), self._usual)

    def refined(self, placement: Placement) -> Placement:
        """The drive placed once more, from where map and drive agree most: the first guess was rough."""
        surest = int(self._compared[np.argmax(placement.shares)])
        return self.place(surest, placement.poses[surest - self._first]) or placement

    def _compare(self, keyframe: int, guess: Pose) -> tuple[Pose, NDArray[np.int64]]:
        """A keyframe's pose (3,) matched with the scans of the map from a guess (3,), which is kept where
        they do not match; and what both see (3,), nothing off the map."""
        near = self._fixed[self._tree.query_ball_point(guess[:2], _NEAR, return_sorted=True)]
        if len(near) == 0:
            return guess, np.zeros(3, dtype=np.int64)
        chosen = near[nearest_pairs(self._poses[near], guess[None], _COMPARED)[0]]
        pairs = np.column_stack([chosen, np.full(len(chosen), keyframe)])
        fixed, moving = between(guess, self._poses[chosen]), np.zeros((len(chosen), 3))
        pairings = Pairings(np.array([0, len(chosen)]), pairs, fixed, moving)
        matched = match(IDENTITY[None], pairings, self._store, self._store, prior_information=_HELD)
        is_good = matched.overlap[0] > MIN_OVERLAP and matched.residual[0] < MAX_RESIDUAL
        step = matched.poses[0] if is_good else IDENTITY
        pose = guess if are_apart(IDENTITY, step, _LARGEST_STEP) else compose(guess, step)
        there = np.broadcast_to(pose, (len(chosen), 3))
        return pose, see_through_each(self._store, pairs, self._poses[chosen], there).sum(axis=0)

    def _neighbours(self, keyframes: NDArray[np.int64]) -> float:
        """Agreement of successive scans of some keyframes (N,)."""
        pairs = np.column_stack([keyframes[:-1], keyframes[1:]])
        seen = see_through(self._store, pairs, self._poses[pairs[:, 0]], self._poses[pairs[:, 1]])
        return seen.agreement if seen.on_surface else 1.0
