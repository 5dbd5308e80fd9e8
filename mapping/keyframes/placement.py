"""Where a new keyframe lies: matched jointly against several before it, from the best of some guesses."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.keyframes.config import GuessConfig, PlacementConfig
from racecar.mapping.keyframes.gap import Gap
from racecar.mapping.keyframes.motion_prior import MotionPrior
from racecar.mapping.keyframes.scan_evidence import scan_evidence
from racecar.mapping.matching.correlative_search import LikelihoodPyramid, Window, search
from racecar.mapping.matching.match_information import as_prior
from racecar.mapping.matching.scan_matching import Matches, Pairings, match
from racecar.mapping.matching.scan_store import ScanStore
from racecar.maps.geometry.se2 import Pose, are_apart, between, compose, transform_points


@dataclass(frozen=True, eq=False)
class Placement:
    """Where a keyframe lies."""

    pose: Pose
    """(3,)"""
    guess: int
    """Which of the guesses led there; the first where none did."""
    is_lost: bool = False
    """Whether the scans contradict it wherever it may lie: then it is the first guess."""
    odds_against_first: float = 0.0
    """Log-odds of it over the place to which the first guess leads."""


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

    def place(self, guesses: Pose, gap: Gap = Gap.NONE) -> Placement:
        """From guesses (H, 3) of the keyframe's pose, the most trusted first.

        Where the scans fit nowhere near, or came after a gap, it is sought in wide windows too. Of all places
        that were found the likeliest is taken, by the motion there and by what the scans show there.
        """
        fixed = self._fixed(guesses[0], gap)
        if not self._may_fit(fixed):
            return self._placed_unlike(fixed, guesses)
        matches, leads = self._match_guesses(fixed, guesses)
        has_fit = gap == Gap.NONE and self._fits(matches)
        if has_fit and len(leads) == 1:
            return Placement(matches.poses[0], 0)
        found = [] if has_fit else self._search(self._windows(guesses[0], gap))
        if found:
            fits = self._match(fixed, np.array(found))
            slid = self._match(fixed, self._slid(fits, guesses[0]))
            matches = matches.with_more(fits).with_more(slid)
            leads += [0] * (2 * len(found))
        odds = self._odds(fixed, guesses, matches, len(found), gap)
        best = int(np.argmax(odds))
        if odds[best] < self.config.lost_odds:
            return Placement(guesses[0], 0, is_lost=True)
        return Placement(matches.poses[best], leads[best], odds_against_first=float(odds[best] - odds[0]))

    def _odds(
        self, fixed: NDArray[np.int64], guesses: Pose, matches: Matches, slid: int, gap: Gap
    ) -> NDArray[np.float64]:
        """(G,) log-odds of each match with keyframes (F,), by the motion that guesses (H, 3) tell and by the
        scans; the last ``slid`` are those before them, slid along what these do not observe. That to which
        the first guess leads stands where the scans show no other place."""
        prior = self._prior(guesses, is_left_alone=gap == Gap.LEFT_ALONE)
        evidence = scan_evidence(
            self.store, fixed, self.poses[fixed], self.index, matches, self.config.evidence
        )
        if slid:  # what speaks for a place on a bare corridor speaks for all of it that is not refuted
            alike, own = evidence[-2 * slid : -slid], evidence[-slid:]
            evidence[-slid:] = np.where(own > -self.config.refuted_odds, np.maximum(own, alike), own)
        # Behind a gap little is seen again; where scans came all the time, little shows no place.
        least = self.config.min_overlap if gap == Gap.NONE else 0.0
        is_shown = self._is_on_lines(matches) & (evidence > 0.0) & (matches.overlap * len(fixed) >= least)
        is_shown[0] = True
        odds = evidence + prior.log_likelihood(matches.poses)
        return np.where(is_shown, odds, -np.inf)

    def _fixed(self, guess: Pose, gap: Gap) -> NDArray[np.int64]:
        """The keyframes (F,) that it is matched with: those before it and, after a gap in which the car drove
        on, those where it should be by now."""
        if gap != Gap.DRIVEN:
            return self._spaced(self.known_since)
        kept = np.flatnonzero(self.store.is_kept[: self.index])
        distances = np.hypot(*(self.poses[kept] - guess)[:, :2].T)
        near = kept[np.argsort(distances, kind="stable")[: self.config.searched_among]]
        return np.union1d(near, self._spaced(0))

    def _spaced(self, since: int) -> NDArray[np.int64]:
        """Some keyframes (F,) before it, ever farther apart, from ``since`` on."""
        backs = self.config.placed_against
        spaced = np.array([self.index - back for back in backs if back <= self.index - since])
        if self.alike is None:
            return spaced
        alike = self.alike[self.alike >= since][::-1]
        return np.union1d(spaced, alike[[back - 1 for back in backs if back <= len(alike)]])

    def _placed_unlike(self, fixed: NDArray[np.int64], guesses: Pose) -> Placement:
        """Among keyframes of other lasers, which may all look elsewhere: where the first guess leads if the
        scans overlap there, or else that guess."""
        matches = self._match(fixed, guesses[:1])
        overlaps = matches.overlap[0] > self.config.lost_overlap
        return Placement(matches.poses[0] if overlaps else guesses[0], 0)

    def _may_fit(self, fixed: NDArray[np.int64]) -> bool:
        """Whether the keyframe looks where some (F,) before it do, so that it fits nowhere if not there."""
        return self.alike is None or bool(np.isin(fixed, self.alike).any())

    def _slid(self, matches: Matches, guess: Pose) -> Pose:
        """Where G matches lie when they follow a guess (3,) in directions that the scans do not observe: what
        was found along a bare corridor lies anywhere along it."""
        prior = as_prior(self.information, config=self.store.config.point_to_line)
        pulls = (between(matches.poses, guess[None]) @ prior)[..., None]
        shifts = np.asarray(np.linalg.solve(matches.hessians + prior, pulls)[..., 0], dtype=np.float64)
        return compose(matches.poses, shifts)

    def _windows(self, guess: Pose, gap: Gap) -> list[tuple[Pose, Window]]:
        """Where it is sought: about the first guess and about the keyframe before, where it is if the guess
        is wrong altogether; a car that was left alone may have been turned round."""
        usual = Window(self.config.search_reach, self.config.search_turn)
        if gap == Gap.LEFT_ALONE:
            return [(guess, usual), (guess, Window(self.config.search_reach, np.pi))]
        return [(guess, usual), (self.here, usual)]

    def _match_guesses(self, fixed: NDArray[np.int64], guesses: Pose) -> tuple[Matches, list[int]]:
        """Where guesses (H, 3) lead, and which they were: from one near to where the first one led, matching
        would lead there again."""
        matches = self._match(fixed, guesses[:1])
        others = [k for k in range(1, len(guesses)) if differ(matches.poses[0], guesses[k], self.config)]
        if others:
            matches = matches.with_more(self._match(fixed, guesses[others]))
        return matches, [0, *others]

    def _fits(self, matches: Matches) -> bool:
        """Scans that overlap but lie off each other's lines came to lie across one another: without wheels a
        fast turn ends so."""
        return bool(((matches.overlap > self.config.lost_overlap) & self._is_on_lines(matches)).any())

    def _is_on_lines(self, matches: Matches) -> NDArray[np.bool_]:
        return matches.residual < self.config.max_residual

    def _prior(self, guesses: Pose, *, is_left_alone: bool) -> MotionPrior:
        config = self.config.prior
        first = config.other_share if self.is_first_doubted else config.first_share
        none = config.carried_share if is_left_alone else config.none_share
        shares = np.array([first, *[config.other_share] * (len(guesses) - 1)])
        # A motion that no source tells may have gone as far as one that they tell.
        reach = self.config.search_reach + float(np.hypot(*between(self.here, guesses[0])[:2]))
        volume = (2.0 * reach) ** 2 * 2.0 * np.pi
        return MotionPrior(guesses, (1.0 - none) * shares / shares.sum(), self.information, volume)

    def _match(self, fixed: NDArray[np.int64], guesses: Pose) -> Matches:
        count, groups = len(fixed), len(guesses)
        pairs = np.tile(np.column_stack([fixed, np.full(count, self.index)]), (groups, 1))
        starts = np.arange(groups + 1) * count
        fixed_poses = np.tile(self.poses[fixed], (groups, 1))
        pairings = Pairings(starts, pairs, fixed_poses, np.zeros((groups * count, 3)))
        prior = as_prior(self.information, config=self.store.config.point_to_line)
        return match(guesses, pairings, self.store, self.store, prior_information=prior)

    def _search(self, windows: Sequence[tuple[Pose, Window]]) -> list[Pose]:
        """Where in each window about a pose (3,) the keyframe lies best on the last ones, if anywhere."""
        moving = self.store.points_of(self.index).astype(np.float64)
        if len(moving) < self.config.min_search_points:
            return []
        last, radius = self.poses[-1], self.config.search_radius
        recent = range(max(self.known_since, self.index - self.config.searched_among), self.index)
        clouds = [transform_points(between(last, self.poses[k]), self.store.points_of(k)) for k in recent]
        fixed = LikelihoodPyramid(np.concatenate(clouds), radius, self.store.config.correlative_search)
        near = moving[np.abs(moving).max(axis=1) < radius]
        fits = [
            search(fixed, near, between(last, pose), window, self.config.search_score)
            for pose, window in windows
        ]
        return [compose(last, fit.pose) for fit in fits if fit is not None]


def differ(guess: Pose, other: Pose, config: GuessConfig) -> bool:
    """Are two guesses (3,) so far apart that matching may lead elsewhere from each?"""
    return are_apart(guess, other, (config.same_guess_distance, config.same_guess_angle))
