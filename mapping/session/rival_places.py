"""Rival places: where else on an earlier map a recognized drive would fit.

Similar rooms agree in every detail: only a search of the whole map shows that there are two.
"""

import math
from concurrent.futures import ThreadPoolExecutor

from racecar.mapping.loops.candidate_search import WITHOUT_DRIFT
from racecar.mapping.loops.hypothesis import Hypothesis
from racecar.mapping.loops.loop_closure import LoopCloser
from racecar.mapping.loops.submap import Submap
from racecar.mapping.loops.submap_search import AMBIGUOUS_SHARE
from racecar.maps.geometry.se2 import Pose, are_apart, between, compose
from racecar.sensors.matching.correlative_search import Fit, LikelihoodPyramid, search, search_apart
from racecar.sensors.threads import thread_count

_PLACE_SPACING = (3.0, math.radians(60.0))
"""Metres between two submaps of the earlier map that are searched, less than the reach so that windows
overlap, and radians between two that may be closer because they see other walls; chosen by judgement."""
_REACH = 4.0
"""Metres searched to each side of each, at any heading. Chosen by judgement: more than their spacing."""
_RADIUS = 20.0
"""Radius in metres of a submap that is searched: about the sample's radius plus the reach, because no point
falls farther away."""
_POINTS = 150
"""Number of points to search with. Measured when chosen, together with the least score: places are recognized
in a third of the time."""
_SAME_PLACE = (1.0, math.radians(10.0))
"""Metres and radians within which two results are one place. Chosen by judgement: as those of a search."""
_WORKERS = 2
"""Threads at most, since the search releases the interpreter's lock and small machines have two cores."""


class RivalPlaces:
    """Searches all of an earlier map with submaps ``known``."""

    def __init__(self, loops: LoopCloser, known: list[Submap], poses: Pose) -> None:
        self._loops, self._known, self._poses = loops, known, poses
        self._places: list[tuple[Submap, LikelihoodPyramid]] = []
        self._rivals: dict[Submap, list[Hypothesis]] = {}

    def of(self, supported: list[Hypothesis]) -> list[Hypothesis]:
        """Hypotheses that the same submaps are elsewhere, where they fit nearly as well and are not refuted
        either."""
        for hypothesis in supported:
            if hypothesis.moving not in self._rivals:
                self._rivals[hypothesis.moving] = self._find(hypothesis)
        return [rival for h in supported for rival in self._rivals[h.moving]]

    def _find(self, hypothesis: Hypothesis) -> list[Hypothesis]:
        moving, loops = hypothesis.moving, self._loops
        points = moving.sample(loops.store, self._poses, _POINTS)
        if points is None:
            return []
        if not self._places:
            self._places = self._surveyed()
        map_from_moving = compose(self._poses[hypothesis.fixed.middle], hypothesis.fixed_from_moving)
        known = search(
            self._pyramid(hypothesis.fixed), points, hypothesis.fixed_from_moving, WITHOUT_DRIFT, 0.0
        )
        least = AMBIGUOUS_SHARE * (1.0 if known is None else known.score)

        def fit(place: tuple[Submap, LikelihoodPyramid]) -> Fit | None:
            there = between(self._poses[place[0].middle], map_from_moving)
            return search_apart(place[1], points, there, _REACH, least)

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
        """Verified hypotheses away from the known place."""
        seen, rivals = [map_from_moving], []
        for found, place in fits:
            pose = compose(self._poses[place.middle], found.pose)
            if not all(are_apart(other, pose, _SAME_PLACE) for other in seen):
                continue
            seen.append(pose)
            rival = self._loops.match(place, moving, self._poses, found.pose, _REACH)
            if rival is None:
                continue
            ended = compose(self._poses[place.middle], rival.fixed_from_moving)
            if are_apart(map_from_moving, ended, _SAME_PLACE):
                rivals.append(rival)
        return rivals

    def _surveyed(self) -> list[tuple[Submap, LikelihoodPyramid]]:
        """One submap per place and heading, with its likelihood pyramid."""
        chosen: list[Submap] = []
        for submap in self._known:
            pose = self._poses[submap.middle]
            others = [self._poses[other.middle] for other in chosen]
            if all(are_apart(other, pose, _PLACE_SPACING) for other in others):
                chosen.append(submap)
        return [(place, self._pyramid(place)) for place in chosen]

    def _pyramid(self, submap: Submap) -> LikelihoodPyramid:
        return submap.pyramid(self._loops.store, self._poses, _RADIUS)
