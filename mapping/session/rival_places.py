"""Rival places: where else on an earlier map a drive fits that was recognized at one place.

Rooms that look alike do so in every single thing: only the search of all the map shows that there are two.
"""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.loops.candidate_search import WITHOUT_DRIFT
from racecar.mapping.loops.hypothesis import Hypothesis
from racecar.mapping.loops.loop_closure import LoopCloser
from racecar.mapping.loops.submap import Submap
from racecar.mapping.matching.correlative_search import Fit, LikelihoodPyramid, search, search_apart
from racecar.mapping.session.config import PlaceRecognitionConfig
from racecar.mapping.threads import thread_count
from racecar.maps.geometry.se2 import Pose, between, compose

_WORKERS = 2
"""Threads at most, since the search is one kernel without the interpreter's lock and small machines have two
cores."""


class RivalPlaces:
    """Searches all of an earlier map, whose submaps are ``known``."""

    def __init__(
        self, loops: LoopCloser, known: list[Submap], poses: Pose, config: PlaceRecognitionConfig
    ) -> None:
        self._loops, self._known, self._poses, self._config = loops, known, poses, config
        self._places: list[tuple[Submap, LikelihoodPyramid]] = []
        self._rivals: dict[Submap, list[Hypothesis]] = {}

    def of(self, supported: list[Hypothesis]) -> list[Hypothesis]:
        """The hypotheses that the same submaps lie elsewhere, where they fit nearly as well and are not
        refuted either."""
        for hypothesis in supported:
            if hypothesis.moving not in self._rivals:
                self._rivals[hypothesis.moving] = self._seek(hypothesis)
        return [rival for h in supported for rival in self._rivals[h.moving]]

    def _seek(self, hypothesis: Hypothesis) -> list[Hypothesis]:
        moving, config, loops = hypothesis.moving, self._config, self._loops
        points = moving.sample(loops.store, self._poses, config.points)
        if points is None:
            return []
        if not self._places:
            self._places = self._surveyed()
        map_from_moving = compose(self._poses[hypothesis.fixed.middle], hypothesis.fixed_from_moving)
        least = config.ambiguous_share * self._score(hypothesis, points)

        def fit(place: tuple[Submap, LikelihoodPyramid]) -> Fit | None:
            there = between(self._poses[place[0].middle], map_from_moving)
            return search_apart(place[1], points, there, config.reach, least)

        with ThreadPoolExecutor(thread_count(_WORKERS)) as pool:
            fits = [
                (found, submap)
                for found, (submap, _) in zip(pool.map(fit, self._places), self._places, strict=True)
                if found is not None
            ]
        fits.sort(key=lambda each: -each[0].score)
        return self._verified(fits, moving, map_from_moving)

    def _verified(
        self, fits: list[tuple[Fit, Submap]], moving: Submap, map_from_moving: Pose
    ) -> list[Hypothesis]:
        """The hypotheses of those that are not refuted, and not of the place that is known."""
        config, seen, rivals = self._config, [map_from_moving], []
        for found, place in fits:
            pose = compose(self._poses[place.middle], found.pose)
            if any(_are_near(other, pose, config) for other in seen):
                continue
            seen.append(pose)
            rival = self._loops.match(place, moving, self._poses, found.pose, config.reach)
            if rival is None:
                continue
            ended = compose(self._poses[place.middle], rival.fixed_from_moving)
            if not _are_near(map_from_moving, ended, config):
                rivals.append(rival)
        return rivals

    def _score(self, hypothesis: Hypothesis, points: NDArray[np.float64]) -> float:
        """Of points (N, 2) where they are known to lie."""
        pyramid = self._pyramid(hypothesis.fixed)
        fit = search(pyramid, points, hypothesis.fixed_from_moving, WITHOUT_DRIFT, 0.0)
        return 1.0 if fit is None else fit.score

    def _surveyed(self) -> list[tuple[Submap, LikelihoodPyramid]]:
        """One submap of each place and heading, with what is searched on."""
        chosen: list[Submap] = []
        for submap in self._known:
            pose = self._poses[submap.middle]
            others = [self._poses[other.middle] for other in chosen]
            if not any(self._shows_the_same(other, pose) for other in others):
                chosen.append(submap)
        return [(place, self._pyramid(place)) for place in chosen]

    def _pyramid(self, submap: Submap) -> LikelihoodPyramid:
        return submap.pyramid(self._loops.store, self._poses, self._config.radius)

    def _shows_the_same(self, a: Pose, b: Pose) -> bool:
        return _is_within(a, b, self._config.place_spacing, self._config.place_turn)


def _are_near(a: Pose, b: Pose, config: PlaceRecognitionConfig) -> bool:
    """Are two poses (3,) on the map one place?"""
    return _is_within(a, b, config.same_distance, config.same_turn)


def _is_within(a: Pose, b: Pose, distance: float, turn: float) -> bool:
    apart = between(a, b)
    return bool(np.hypot(apart[0], apart[1]) < distance and abs(apart[2]) < turn)
