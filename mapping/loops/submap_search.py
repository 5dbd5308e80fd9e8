"""Correlative search of one submap in another."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.loops.candidate_search import WITHOUT_DRIFT
from racecar.mapping.loops.submap import Submap
from racecar.maps.geometry.se2 import Pose, between
from racecar.sensors.matching.correlative_search import Fit, LikelihoodPyramid, Window, search
from racecar.sensors.matching.scan_store import ScanStore

MIN_SCORE = 0.2
"""Minimum mean likelihood of a match. Chosen by judgement: two submaps of a laser that sees 4 m far share a
third of what they show where their paths cross."""
AMBIGUOUS_SHARE = 0.85
"""Score of a second peak, relative to the best, from which the search is ambiguous. Measured: chosen in a
prototype on aces, intel and fr079."""
_LIKELY_SHARE = 0.25
"""Share of the drift window that usually suffices, because drift is usually less; chosen by judgement."""
_NEAR_SHARE = 0.65
"""Score of a near peak relative to a far one from which the far one is ambiguous. Chosen by judgement: it
must fit far better."""
_RADIUS = 25.0
"""Radius in metres of the submap that is searched, because it exceeds the sample's radius plus the widest
usual window."""
_POINTS = 500
"""Number of points to search with at most, because of the time it takes; chosen by judgement."""
_MOST_PYRAMIDS = 48
"""Cached pyramids of recently searched submaps, because neighbours search the same ones; some 2 MB each."""


class SubmapSearch:
    """Searches submaps of a store, with a cache of likelihood pyramids."""

    def __init__(self, store: ScanStore, count: Callable[[str], None]) -> None:
        """``count`` is called for each event: ``searched``, ``scored``, ``ambiguous``."""
        self._store, self._count = store, count
        self._pyramids: dict[Submap, LikelihoodPyramid] = {}

    def find(self, fixed: Submap, moving: Submap, poses: Pose, window: Window) -> Pose | None:
        """fixed_from_moving (3,) of the best match, in a window around the prediction from the poses (K, 3)
        of the keyframes; None when nothing fits, or it is ambiguous."""
        points = moving.sample(self._store, poses, _POINTS)
        if points is None:
            return None
        self._count("searched")
        guess = between(poses[fixed.middle], poses[moving.middle])
        fit = self._search(self._pyramid(fixed, poses), points, guess, window)
        return None if fit is None else fit.pose

    def _search(
        self, fixed: LikelihoodPyramid, points: NDArray[np.float64], guess: Pose, window: Window
    ) -> Fit | None:
        """The unique match of the points in the window; None when there is none, or more than one.

        Drift seldom fills the window: a peak near the guess wins against an equal one farther away, and a far
        one must score far better than any near one.
        """
        base = WITHOUT_DRIFT.reach
        near_window = Window(base + _LIKELY_SHARE * (window.reach - base), window.turn)
        near = search(fixed, points, guess, near_window, MIN_SCORE, AMBIGUOUS_SHARE)
        least = MIN_SCORE if near is None else min(near.score / AMBIGUOUS_SHARE, 1.0)
        far = search(fixed, points, guess, window, least, AMBIGUOUS_SHARE)
        fit = near if far is None else far
        if fit is None:
            return None
        self._count("scored")
        is_near_as_good = near is not None and far is not None and near.score > _NEAR_SHARE * far.score
        if is_near_as_good or fit.runner_up > 0.0:
            self._count("ambiguous")
            return None
        return fit

    def _pyramid(self, submap: Submap, poses: Pose) -> LikelihoodPyramid:
        if submap not in self._pyramids:
            if len(self._pyramids) >= _MOST_PYRAMIDS:
                self._pyramids.pop(next(iter(self._pyramids)))
            self._pyramids[submap] = submap.pyramid(self._store, poses, _RADIUS)
        return self._pyramids[submap]
