"""The correlative search of one submap on another."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.loops.candidate_search import WITHOUT_DRIFT
from racecar.mapping.loops.submap import Submap
from racecar.maps.geometry.se2 import Pose, between
from racecar.sensors.matching.correlative_search import Fit, LikelihoodPyramid, Window, search
from racecar.sensors.matching.scan_store import ScanStore

_MIN_SCORE = 0.2
"""Least mean likelihood of the points at a place that is accepted. By judgement: two submaps of a laser that
sees 4 m far share a third of what they show where their paths cross."""
AMBIGUOUS_SHARE = 0.85
"""Score of a second place, as a share of the best, from which the search is ambiguous. Measured: chosen in a
prototype on aces, intel and fr079."""
_LIKELY_SHARE = 0.25
"""Share of the window beyond what is searched without drift that the drift fills, because usually it does no
more; by judgement."""
_NEAR_SHARE = 0.65
"""Share of the score of a place farther off from which a near place makes it ambiguous. By judgement: it must
fit far better."""
_RADIUS = 25.0
"""Metres about its middle of which a submap is searched on, because the sample's radius and the widest usual
window are together less."""
_POINTS = 500
"""Points that are searched with at most, because of the time it takes; by judgement."""
_MOST_PYRAMIDS = 48
"""Of the submaps searched on last, kept because neighbours are sought on the same ones; some 2 MB each."""


class SubmapSearch:
    """Searches submaps of a store; it keeps the likelihood pyramids of those searched on last."""

    def __init__(self, store: ScanStore, count: Callable[[str], None]) -> None:
        """``count`` is called with each thing that happens: ``searched``, ``scored``, ``ambiguous``."""
        self._store, self._count = store, count
        self._pyramids: dict[Submap, LikelihoodPyramid] = {}

    def find(self, fixed: Submap, moving: Submap, poses: Pose, window: Window) -> Pose | None:
        """fixed_from_moving (3,) where the moving submap fits the fixed one, within a window about where the
        poses (K, 3) of the keyframes put it; None when it fits nowhere, or in more than one place."""
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
        """The one place in the window where the points fit; None when there is none, or more than one.

        Drift seldom fills the window: a place near the guess wins against an equally good one farther off,
        and one farther off must fit far better than any near.
        """
        base = WITHOUT_DRIFT.reach
        near_window = Window(base + _LIKELY_SHARE * (window.reach - base), window.turn)
        near = search(fixed, points, guess, near_window, _MIN_SCORE, AMBIGUOUS_SHARE)
        least = _MIN_SCORE if near is None else min(near.score / AMBIGUOUS_SHARE, 1.0)
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
