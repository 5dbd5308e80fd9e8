"""Two moments, each with the scans about it: the passes that may or may not be through one place."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import SAME_PASS
from racecar.mapping.mending.manual_constraints import Distrust, Moment, NotSamePlace, SamePlace
from racecar.mapping.mending.moments import keyframe_at, submap_about
from racecar.mapping.quality.map_quality import DoubtfulSegment
from racecar.mapping.session.session import Session
from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import Pose, between, compose, transform_points
from racecar.pipelines.studio.mend.described import when

_DIGITS = 3
"""Decimals of seconds in a constraint: scans are farther apart than a millisecond."""


class Passes:
    """The chosen keyframes, and how far the second pass was moved by hand."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._kept = np.flatnonzero(session.keyframes.is_kept)
        self.first: int | None = None
        self.second: int | None = None
        self.moved = np.zeros(3)
        """(3,) metres and radians by which the second pass was shifted, and turned about its keyframe."""

    def choose(self, first: int | None, second: int | None = None) -> None:
        """Choose keyframes, where the map has them."""
        self.first, self.second, self.moved = first, second, np.zeros(3)

    def pair_of(self, doubt: DoubtfulSegment, poses: Pose) -> tuple[int, int]:
        """The keyframes where both passes of a doubtful segment are closest, with keyframes at ``poses``
        (K, 3); its first and last, if no other pass contradicts it."""
        own = self._kept_between(*doubt.keyframes)
        if doubt.contradicted_by is None:
            return int(own[0]), int(own[-1])
        other = self._kept_between(*doubt.contradicted_by)
        apart = np.hypot(*np.moveaxis(poses[other, None, :2] - poses[None, own, :2], 2, 0))
        a, b = np.unravel_index(np.argmin(apart), apart.shape)
        first, second = sorted((int(other[a]), int(own[b])))
        return first, second

    def choose_place(self, place: NDArray[np.float64], poses: Pose) -> None:
        """Choose the keyframe nearest to a place (2,), with keyframes at ``poses`` (K, 3): by turns the first
        moment, and one of another pass as the second."""
        first = self.first if self.second is None else None
        known = self._kept if first is None else self._kept[np.abs(self._kept - first) > SAME_PASS]
        if len(known) == 0:
            raise UserError("The drive is too short for a second pass.")
        nearest = int(known[np.argmin(np.hypot(*(poses[known, :2] - place).T))])
        self.choose(*((nearest,) if first is None else (first, nearest)))

    def choose_moments(self, first: Moment, second: Moment) -> None:
        """Choose two moments. Raises UserError when there are none."""
        self.choose(*(keyframe_at(moment, self._session) for moment in (first, second)))

    def choose_moment(self, moment: Moment, *, is_second: bool) -> None:
        """Choose the first or the second moment. Raises UserError when there is none."""
        keyframe = keyframe_at(moment, self._session)
        self.choose(*((self.first, keyframe) if is_second else (keyframe, self.second)))

    def name_of(self, doubt: DoubtfulSegment, poses: Pose) -> str:
        """The two moments of a doubtful segment."""
        first, second = self.pair_of(doubt, poses)
        between_both = "to" if doubt.contradicted_by is None else "and"
        return f"{self.words_of(first)} {between_both} {self.words_of(second)}"

    def words_of(self, keyframe: int) -> str:
        """When it was seen."""
        return when(self._moment(keyframe))

    def same_place(self, poses: Pose) -> SamePlace:
        """Both moments are at one place: as the second pass was moved from where the map with keyframes at
        ``poses`` (K, 3) has it, otherwise wherever it fits. Raises UserError without two moments."""
        first, second = self._both()
        moments = self._moment(first), self._moment(second)
        if not self.moved.any():
            return SamePlace(*moments)
        mounts = self._session.keyframe_from_base
        map_from_first = compose(poses[first], mounts[first])
        map_from_second = compose(poses[second] + self.moved, mounts[second])
        x, y, yaw = between(map_from_first, map_from_second).tolist()
        return SamePlace(*moments, (x, y, yaw))

    def not_same_place(self) -> NotSamePlace:
        """Both moments are at different places. Raises UserError without two moments."""
        return NotSamePlace(*map(self._moment, self._both()))

    def distrust(self, source: Literal["wheels", "scans"]) -> Distrust:
        """Wheels or scans were misled between both moments. Raises UserError without two moments."""
        return Distrust(source, *map(self._moment, sorted(self._both())))

    def points(self, poses: Pose, moved: Pose) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(N, 2) and (M, 2) metres in the map with keyframes at ``poses`` (K, 3): what the scans of both
        passes saw, the second one ``moved``. Empty without such a moment."""
        return self._seen(self.first, poses, np.zeros(3)), self._seen(self.second, poses, moved)

    def _seen(self, keyframe: int | None, poses: Pose, moved: Pose) -> NDArray[np.float64]:
        if keyframe is None:
            return np.zeros((0, 2))
        submap = submap_about(keyframe, self._session, poses)
        return transform_points(poses[keyframe] + moved, submap.points(self._session.keyframes, poses))

    def _moment(self, keyframe: int) -> Moment:
        times = self._session.times
        number = int(times.numbers[keyframe]) if len(times.recordings) > 1 else None
        return Moment(round(float(times.seconds[keyframe]), _DIGITS), number)

    def _both(self) -> tuple[int, int]:
        if self.first is None or self.second is None:
            raise UserError("Choose two moments first: a doubt, or two places of the path.")
        return self.first, self.second

    def _kept_between(self, first: int, last: int) -> NDArray[np.int64]:
        inside = self._kept[(self._kept >= first) & (self._kept <= last)]
        return inside if len(inside) else np.array([first])
