"""The correlative search of one submap on another."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.loops.config import LoopClosureConfig
from racecar.mapping.loops.submap import Submap
from racecar.mapping.matching.correlative_search import Fit, LikelihoodPyramid, Window, search
from racecar.mapping.matching.scan_store import ScanStore
from racecar.maps.geometry.se2 import Pose, between

_MOST_PYRAMIDS = 48
"""Of the submaps searched on last, kept because neighbours are sought on the same ones; some 2 MB each."""


class SubmapSearch:
    """Searches submaps of a store; it keeps the likelihood pyramids of those searched on last."""

    def __init__(self, store: ScanStore, config: LoopClosureConfig, count: Callable[[str], None]) -> None:
        """``count`` is called with each thing that happens: ``searched``, ``scored``, ``ambiguous``."""
        self._store, self._count = store, count
        self._config, self._submaps, self._candidates = config.search, config.submaps, config.candidates
        self._pyramids: dict[Submap, LikelihoodPyramid] = {}

    def find(self, fixed: Submap, moving: Submap, poses: Pose, window: Window) -> Pose | None:
        """fixed_from_moving (3,) where the moving submap fits the fixed one, within a window about where the
        poses (K, 3) of the keyframes put it; None when it fits nowhere, or in more than one place."""
        points = moving.sample(self._store, poses, self._config.points, self._submaps)
        if points is None:
            return None
        self._count("searched")
        guess = between(poses[fixed.middle], poses[moving.middle])
        fit = self._search(self._pyramid(fixed, poses), points, guess, window)
        return None if fit is None else fit.pose

    def forget_pyramids(self) -> None:
        """Forget the pyramids; they are built again when needed."""
        self._pyramids.clear()

    def _search(
        self, fixed: LikelihoodPyramid, points: NDArray[np.float64], guess: Pose, window: Window
    ) -> Fit | None:
        """The one place in the window where the points fit; None when there is none, or more than one.

        Drift seldom fills the window: a place near the guess wins against an equally good one farther off,
        and one farther off must fit far better than any near.
        """
        base, config = self._candidates.base_reach, self._config
        near_window = Window(base + config.likely_share * (window.reach - base), window.turn)
        near = search(fixed, points, guess, near_window, config.min_score, config.ambiguous_share)
        least = config.min_score if near is None else min(near.score / config.ambiguous_share, 1.0)
        far = search(fixed, points, guess, window, least, config.ambiguous_share)
        fit = near if far is None else far
        if fit is None:
            return None
        self._count("scored")
        is_near_as_good = near is not None and far is not None and near.score > config.near_share * far.score
        if is_near_as_good or fit.runner_up > 0.0:
            self._count("ambiguous")
            return None
        return fit

    def _pyramid(self, submap: Submap, poses: Pose) -> LikelihoodPyramid:
        if submap not in self._pyramids:
            if len(self._pyramids) >= _MOST_PYRAMIDS:
                self._pyramids.pop(next(iter(self._pyramids)))
            points = submap.points(self._store, poses, self._submaps)
            self._pyramids[submap] = LikelihoodPyramid(
                points, self._config.radius, self._store.config.correlative_search
            )
        return self._pyramids[submap]
