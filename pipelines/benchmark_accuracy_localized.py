"""A recording's scans where the localizer put them, and where the scans about one of them put it.

Each of these is matched alone, and carried to it by what a map of the recording tells of the way between.
One scan may fit best in a wrong place; forty seldom do together.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from localization.localizer import Localizer
from maps.odometry import Odometry
from maps.scan import Scan
from maps.se2 import Pose, between, compose
from maps.trajectory import Trajectory
from pipelines.benchmark_accuracy_matcher import ExhaustiveMatcher
from pipelines.localization_run import estimates

_BEFORE_AND_AFTER, _EVERY = 160, 8
"""Scans."""


@dataclass(frozen=True, eq=False)
class LocalizedScans:
    """What a localizer made of a recording."""

    scans: list[Scan]
    map_from_base: list[Pose]
    """(3,) of each."""
    searches: int
    """How often the place was searched for."""

    def place_by_others(
        self, index: int, own_trajectory: Trajectory, matcher: ExhaustiveMatcher
    ) -> NDArray[np.float64]:
        """Where (2,) on the map those about a scan put it: the median.

        ``own_trajectory`` lies on the map that is made of the recording.
        """
        way = dict(zip(own_trajectory.stamps.tolist(), own_trajectory.map_from_base, strict=True))
        here = way[self.scans[index].stamp]
        told = [
            compose(matcher.match(scan, map_from_base)[0], between(way[scan.stamp], here))
            for scan, map_from_base in self._others(index)
        ]
        place: NDArray[np.float64] = np.median(np.array(told)[:, :2], axis=0)
        return place

    def _others(self, index: int) -> list[tuple[Scan, Pose]]:
        window = range(index - _BEFORE_AND_AFTER, index + _BEFORE_AND_AFTER + 1, _EVERY)
        others = (k for k in window if 0 <= k < len(self.scans) and k != index)
        return [(self.scans[k], self.map_from_base[k]) for k in others]


def localize(messages: Iterable[Scan | Odometry], localizer: Localizer) -> LocalizedScans:
    """Feed all messages to a localizer."""
    scans, poses, searches = [], [], 0
    for scan, estimate in estimates(messages, localizer):
        searches += estimate.is_start
        scans.append(scan)
        poses.append(estimate.map_from_base)
    return LocalizedScans(scans, poses, searches)
