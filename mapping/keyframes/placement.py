"""Where a new keyframe lies: matched jointly against several before it, from the best of some guesses."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.keyframes.config import GuessConfig, PlacementConfig
from racecar.mapping.keyframes.gap import Gap
from racecar.mapping.matching.correlative_search import LikelihoodPyramid, Window, search
from racecar.mapping.matching.match_information import as_prior
from racecar.mapping.matching.scan_matching import Matches, Pairings, match
from racecar.mapping.matching.scan_store import ScanStore
from racecar.mapping.matching.see_through import see_through
from racecar.maps.geometry.se2 import Pose, are_apart, between, compose, transform_points


@dataclass(frozen=True, eq=False)
class KeyframePlacer:
    """Places one keyframe of a store among those before it."""

    index: int
    """Of the keyframe to be placed."""
    store: ScanStore
    poses: Pose
    """(K, 3) of the keyframes before it."""
    here: Pose
    """(3,) where it would lie, had the car stood since the last of them."""
    information: NDArray[np.float64]
    """(3, 3) what the guesses are worth, in the frame of the keyframe."""
    config: PlacementConfig
    known_since: int = 0
    """Keyframes before this one are elsewhere."""
    is_first_doubted: bool = False
    """Whether the first guess may be one that says nothing, of wheels that repeat a pose."""
    alike: NDArray[np.int64] | None = None
    """(A,) keyframes of the same laser, where there are several; those of others may look elsewhere."""

    def place(self, guesses: Pose, gap: Gap = Gap.NONE) -> tuple[Pose, int]:
        """The keyframe's pose (3,) from guesses (H, 3) of it, the most trusted first, and which guess led
        there."""
        if gap == Gap.DRIVEN:
            return replace(self, known_since=0)._place_far(guesses)
        return self._place_left_alone(guesses) if gap == Gap.LEFT_ALONE else self._place_near(guesses)

    def _place_near(self, guesses: Pose) -> tuple[Pose, int]:
        """Where the scans fit nowhere near, they are sought in wide windows about the first guess and about
        the keyframe before."""
        fixed = self._spaced()
        if not self._may_fit(fixed):
            return self._placed_unlike(fixed, guesses)
        placed, chosen, fits = self._match_best(fixed, guesses)
        if fits:
            return placed, chosen
        windows = [(guesses[0], self._window()), (self.here, self._window())]
        found = [pose for pose in self._search(windows) if pose is not None]
        if not found:
            return placed, chosen
        placed, chosen, _ = self._match_best(fixed, np.concatenate([guesses, found]))
        return placed, chosen if chosen < len(guesses) else 0

    def _place_left_alone(self, guesses: Pose) -> tuple[Pose, int]:
        """After a gap in which the car stood: it may have been moved by hand.

        So it is always sought, also facing any way; but that way it must fit clearly better, for corridors
        look alike both ways.
        """
        fixed = self._spaced()
        if not self._may_fit(fixed):
            return self._placed_unlike(fixed, guesses)
        placed, chosen, _ = self._match_best(fixed, guesses)
        all_round = Window(self.config.search_reach, np.pi)
        nearby, turned = self._search([(guesses[0], self._window()), (guesses[0], all_round)])
        for found, least_gain in ((nearby, 1.0), (turned, self.config.clearly_better)):
            better = self._better(fixed, placed, found, least_gain)
            if better is not None:
                placed, chosen = better, 0
        return placed, chosen

    def _place_far(self, guesses: Pose) -> tuple[Pose, int]:
        """After a gap in which the car drove on.

        It is matched against those where it should be by now, and not sought in a wide window there, in which
        many a place may look alike. Wheels that began anew report a distance that nobody drove: so it is
        matched against the last keyframes too, and sought about them where it fits nowhere.
        """
        kept = np.flatnonzero(self.store.is_kept[: self.index])
        distances = np.hypot(*(self.poses[kept] - guesses[0])[:, :2].T)
        near = kept[np.argsort(distances, kind="stable")[: self.config.searched_among]]
        fixed = np.union1d(near, self._spaced())
        placed, chosen, fits = self._match_best(fixed, guesses)
        if fits or not self._may_fit(self._spaced()):
            return placed, chosen
        (found,) = self._search([(self.here, self._window())])
        better = self._better(fixed, placed, found, self.config.clearly_better)
        return (placed, chosen) if better is None else (better, 0)

    def _spaced(self) -> NDArray[np.int64]:
        backs = self.config.placed_against
        spaced = np.array([self.index - back for back in backs if back <= self.index - self.known_since])
        if self.alike is None:
            return spaced
        alike = self.alike[self.alike >= self.known_since][::-1]
        return np.union1d(spaced, alike[[back - 1 for back in backs if back <= len(alike)]])

    def _placed_unlike(self, fixed: NDArray[np.int64], guesses: Pose) -> tuple[Pose, int]:
        """Among keyframes of other lasers, which may all look elsewhere: where the first guess leads if the
        scans overlap there, or else that guess."""
        matches = self._match(fixed, guesses[:1])
        return (matches.poses[0] if matches.overlap[0] > self.config.lost_overlap else guesses[0]), 0

    def _may_fit(self, fixed: NDArray[np.int64]) -> bool:
        """Whether the keyframe looks where some (F,) before it do, so that it fits nowhere if not there."""
        return self.alike is None or bool(np.isin(fixed, self.alike).any())

    def _window(self) -> Window:
        return Window(self.config.search_reach, self.config.search_turn)

    def _match_best(self, fixed: NDArray[np.int64], guesses: Pose) -> tuple[Pose, int, bool]:
        """The pose (3,) to which the best of guesses (H, 3) leads, which guess that is, and whether scans
        fit.

        From a guess near to where the first one led, matching would lead there again. Scans that overlap but
        lie off each other's lines came to lie across one another: without wheels a fast turn ends so.
        """
        matches = self._match(fixed, guesses[:1])
        others = [k for k in range(1, len(guesses)) if differ(matches.poses[0], guesses[k], self.config)]
        if others:
            matches = matches.with_more(self._match(fixed, guesses[others]))
        best = self._best(matches)
        overlaps = matches.overlap.max() > self.config.lost_overlap
        fits = overlaps and matches.residual[best] < self.config.max_residual
        return matches.poses[best], [0, *others][best], bool(fits)

    def _best(self, matches: Matches) -> int:
        """A later guess wins only where the scans fit clearly better from it than from the first."""
        best = int(np.argmax(matches.weight))
        fits = (
            matches.overlap[best] > self.config.min_overlap
            and matches.residual[best] < self.config.max_residual
        )
        least_gain = self.config.better_than_standing if self.is_first_doubted else self.config.clearly_better
        is_better = matches.weight[best] > least_gain * matches.weight[0]
        return best if fits and is_better else 0

    def _match(self, fixed: NDArray[np.int64], guesses: Pose) -> Matches:
        count, groups = len(fixed), len(guesses)
        pairs = np.tile(np.column_stack([fixed, np.full(count, self.index)]), (groups, 1))
        starts = np.arange(groups + 1) * count
        fixed_poses = np.tile(self.poses[fixed], (groups, 1))
        pairings = Pairings(starts, pairs, fixed_poses, np.zeros((groups * count, 3)))
        prior = as_prior(self.information, config=self.store.config.point_to_line)
        return match(guesses, pairings, self.store, self.store, prior_information=prior)

    def _search(self, windows: Sequence[tuple[Pose, Window]]) -> list[Pose | None]:
        """Where in each window about a pose (3,) the keyframe lies best on the last ones, if anywhere."""
        moving = self.store.points_of(self.index).astype(np.float64)
        if len(moving) < self.config.min_search_points:
            return [None] * len(windows)
        last, radius = self.poses[-1], self.config.search_radius
        recent = range(max(self.known_since, self.index - self.config.searched_among), self.index)
        clouds = [transform_points(between(last, self.poses[k]), self.store.points_of(k)) for k in recent]
        fixed = LikelihoodPyramid(np.concatenate(clouds), radius, self.store.config.correlative_search)
        near = moving[np.abs(moving).max(axis=1) < radius]
        fits = [
            search(fixed, near, between(last, pose), window, self.config.search_score)
            for pose, window in windows
        ]
        return [None if fit is None else compose(last, fit.pose) for fit in fits]

    def _better(
        self, fixed: NDArray[np.int64], placed: Pose, found: Pose | None, least_gain: float
    ) -> Pose | None:
        """Where a pose (3,) that was found leads, if the scans fit so many times better there than where the
        keyframe is placed.

        Scans that share little of their view fit by chance here and there: how much of the rest they look
        through shows.
        """
        if found is None:
            return None
        matches = self._match(fixed, np.stack([placed, found]))
        pairs = np.column_stack([fixed, np.full(len(fixed), self.index)])
        tests = [
            see_through(self.store, pairs, self.poses[fixed], np.tile(pose, (len(fixed), 1)))
            for pose in matches.poses
        ]
        before, after = matches.weight * [test.agreement for test in tests]
        return matches.poses[1] if after > least_gain * before else None


def differ(guess: Pose, other: Pose, config: GuessConfig) -> bool:
    """Are two guesses (3,) so far apart that matching may lead elsewhere from each?"""
    return are_apart(guess, other, (config.same_guess_distance, config.same_guess_angle))
