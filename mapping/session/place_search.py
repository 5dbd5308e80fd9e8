"""Search an earlier map for the places where a submap of another drive may lie.

Similar rooms agree in every detail: only a search of the whole map shows how many there are.
"""

import math

import numpy as np

from racecar.mapping.loops.submap import Submap
from racecar.mapping.loops.submap_search import AMBIGUOUS_SHARE, MIN_SCORE
from racecar.maps.geometry.se2 import IDENTITY, Pose, are_apart, between, compose
from racecar.sensors.matching.correlative_search import LikelihoodPyramid, Window, search
from racecar.sensors.matching.scan_store import ScanStore

_PLACE_SPACING = (5.0, math.radians(60.0))
"""Metres between two submaps of the earlier map that are searched, less than the reach so that windows
overlap, and radians between two that may be closer because they see other walls; chosen by judgement."""
_ANYWHERE = Window(4.0, math.pi)
"""Searched about each. Chosen by judgement: more than their spacing."""
_NEARBY = Window(1.0, math.radians(20.0))
"""Searched about a place that a person stated. Chosen by judgement: as well as one can point at a map."""
_RADIUS = 20.0
"""Radius in metres of a submap that is searched: about the sample's radius plus the reach, because no point
falls farther away."""
_POINTS = 150
"""Number of points to search with. Measured when chosen: places are found in a third of the time."""
_SAME_PLACE = (1.0, math.radians(10.0))
"""Metres and radians within which two results are one place. Chosen by judgement: as those of a search."""


def are_one_place(one: Pose, other: Pose) -> bool:
    """Whether two poses (3,) are so close that one search would not tell them apart."""
    return not are_apart(one, other, _SAME_PLACE)


class PlaceSearch:
    """Searches the submaps ``known`` of an earlier map, with keyframes of ``store`` at ``poses`` (K, 3)."""

    def __init__(self, store: ScanStore, known: list[Submap], poses: Pose) -> None:
        self._store, self._poses = store, poses
        self._places: list[tuple[Pose, LikelihoodPyramid]] = []
        for submap in known:
            pose = poses[submap.middle]
            if all(are_apart(other, pose, _PLACE_SPACING) for other, _ in self._places):
                self._places.append((pose, submap.pyramid(store, poses, _RADIUS)))

    def anywhere(self, moving: Submap) -> list[Pose]:
        """Poses (3,) of a submap's centre on the map where it fits nearly as well as anywhere, best first."""
        all_places = [(place, pyramid, IDENTITY) for place, pyramid in self._places]
        return self._best(moving, all_places, _ANYWHERE)

    def near(self, moving: Submap, stated: Pose) -> list[Pose]:
        """The same near a stated pose (3,); none where the map shows nothing."""
        guesses = [(place, pyramid, between(place, stated)) for place, pyramid in self._places]
        close = [each for each in guesses if np.hypot(*each[2][:2]) < _ANYWHERE.reach]
        return self._best(moving, close, _NEARBY)

    def _best(
        self, moving: Submap, places: list[tuple[Pose, LikelihoodPyramid, Pose]], window: Window
    ) -> list[Pose]:
        points = moving.sample(self._store, self._poses, _POINTS)
        if points is None:
            return []
        found: list[tuple[float, Pose]] = []
        least = MIN_SCORE
        for place, pyramid, guess in places:
            fit = search(pyramid, points, guess, window, least)
            if fit is not None:
                found.append((fit.score, compose(place, fit.pose)))
                least = max(least, AMBIGUOUS_SHARE * fit.score)
        distinct: list[Pose] = []
        for score, pose in sorted(found, key=lambda each: -each[0]):
            if score >= least and not any(are_one_place(pose, other) for other in distinct):
                distinct.append(pose)
        return distinct
