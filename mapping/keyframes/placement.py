"""Where a new keyframe lies: matched jointly against several before it, from the best of some guesses."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.keyframes.constraints import TIED_TO
from racecar.mapping.keyframes.gap import Gap
from racecar.mapping.keyframes.motion_prior import guess_shares, log_likelihood
from racecar.mapping.keyframes.scan_evidence import scan_evidence
from racecar.maps.geometry.se2 import Pose, are_apart, between, compose, transform_points
from racecar.sensors.matching.correlative_search import LikelihoodPyramid, Window, search
from racecar.sensors.matching.match_information import as_prior
from racecar.sensors.matching.scan_matching import Matches, Pairings, match
from racecar.sensors.matching.scan_store import ScanStore

SAME_GUESS = 0.1, 0.05
"""Metres and radians between two guesses within which matching leads to the same place. By judgement: less
than the distance within which partners are looked for in the end."""
REFUTED_ODDS = 5.0
"""Log-odds of another place over the one to which the first guess leads, from which on the scans refute what
wheels say of the step. By judgement: 150 to 1."""
MIN_SEARCH_POINTS = 30
"""Points of a scan below which there is no search, since few fit anywhere."""
_PLACED_AGAINST = TIED_TO[:5]
"""With which keyframes, counted back along the path, a new one is matched jointly. By judgement: the first of
those that it is tied to, which surely overlap."""
_MIN_OVERLAP = 0.1
"""Share of points with a partner, summed over the scans that a keyframe is matched with, below which no scan
shows a place where scans came all the time; it then loses against the first guess. Measured: without it,
simulated drives over a slope were off by 0.39 and 0.56 m instead of 0.04 and 0.07 m."""
_MAX_RESIDUAL = 0.02
"""Metres, weighted root mean square distance to the lines, above which the scans came to lie across one
another, as after a fast turn. Measured with `racecar map --no-odom`: judging by it and not by overlap alone
took aces from 0.109 to 0.068 m, fr079 from 2.68 to 0.044 m, intel from 0.231 to 0.025 m."""
_LOST_ODDS = -15.0
"""Log-odds of the likeliest place below which the keyframe is lost. By judgement: on aces with a scan every
two seconds true places had -11 and more, wrong ones -22 and less."""
_LOST_OVERLAP = 0.2
"""Share of points with a partner from the best guess, below which the keyframe is lost and searched for in
wide windows. By judgement: two keyframes in a row share several times as much."""
_SEARCHED_AMONG = 20
"""Keyframes before a lost one, among which it is placed. By judgement: some 6 m of path."""
_SEARCH_REACH = 1.5
"""Metres to each side that a lost keyframe is searched for. By judgement: on session_A the car was carried a
metre while nothing was recorded."""
_SEARCH_TURN = 0.25 * np.pi
"""Radians to each side, the same. By judgement: a car turns by less between two keyframes."""
_SEARCH_RADIUS = 20.0
"""Metres from the laser, beyond which points do not take part in the search. By judgement: farther, beams lie
too wide apart."""
_SEARCH_SCORE = 0.4
"""Mean likelihood of the points that a place found by the search has at least. By judgement: it is matched
and judged afterwards."""


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
        if self.alike is not None and not np.isin(fixed, self.alike).any():
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
        if odds[best] < _LOST_ODDS:
            return Placement(guesses[0], 0, is_lost=True)
        return Placement(matches.poses[best], leads[best], odds_against_first=float(odds[best] - odds[0]))

    def _odds(
        self, fixed: NDArray[np.int64], guesses: Pose, matches: Matches, slid: int, gap: Gap
    ) -> NDArray[np.float64]:
        """(G,) log-odds of each match with keyframes (F,), by the motion that guesses (H, 3) tell and by the
        scans; the last ``slid`` are those before them, slid along what these do not observe. That to which
        the first guess leads stands where the scans show no other place."""
        evidence = scan_evidence(self.store, fixed, self.poses[fixed], self.index, matches)
        if slid:  # what speaks for a place on a bare corridor speaks for all of it that is not refuted
            alike, own = evidence[-2 * slid : -slid], evidence[-slid:]
            evidence[-slid:] = np.where(own > -REFUTED_ODDS, np.maximum(own, alike), own)
        # Behind a gap little is seen again; where scans came all the time, little shows no place.
        least = _MIN_OVERLAP if gap == Gap.NONE else 0.0
        is_shown = self._is_on_lines(matches) & (evidence > 0.0) & (matches.overlap * len(fixed) >= least)
        is_shown[0] = True
        shares = guess_shares(
            len(guesses), is_first_doubted=self.is_first_doubted, is_left_alone=gap == Gap.LEFT_ALONE
        )
        # A motion that no source tells may have gone as far as one that they tell.
        reach = _SEARCH_REACH + float(np.hypot(*between(self.here, guesses[0])[:2]))
        prior = log_likelihood(matches.poses, guesses, shares, self.information, reach)
        return np.where(is_shown, evidence + prior, -np.inf)

    def _fixed(self, guess: Pose, gap: Gap) -> NDArray[np.int64]:
        """The keyframes (F,) that it is matched with: those before it and, after a gap in which the car drove
        on, those where it should be by now."""
        if gap != Gap.DRIVEN:
            return self._spaced(self.known_since)
        kept = np.flatnonzero(self.store.is_kept[: self.index])
        distances = np.hypot(*(self.poses[kept] - guess)[:, :2].T)
        near = kept[np.argsort(distances, kind="stable")[:_SEARCHED_AMONG]]
        return np.union1d(near, self._spaced(0))

    def _spaced(self, since: int) -> NDArray[np.int64]:
        """Some keyframes (F,) before it, ever farther apart, from ``since`` on."""
        spaced = np.array([self.index - back for back in _PLACED_AGAINST if back <= self.index - since])
        if self.alike is None:
            return spaced
        alike = self.alike[self.alike >= since][::-1]
        return np.union1d(spaced, alike[[back - 1 for back in _PLACED_AGAINST if back <= len(alike)]])

    def _placed_unlike(self, fixed: NDArray[np.int64], guesses: Pose) -> Placement:
        """Among keyframes of other lasers, which may all look elsewhere: where the first guess leads if the
        scans overlap there, or else that guess."""
        matches = self._match(fixed, guesses[:1])
        overlaps = matches.overlap[0] > _LOST_OVERLAP
        return Placement(matches.poses[0] if overlaps else guesses[0], 0)

    def _slid(self, matches: Matches, guess: Pose) -> Pose:
        """Where G matches lie when they follow a guess (3,) in directions that the scans do not observe: what
        was found along a bare corridor lies anywhere along it."""
        prior = as_prior(self.information)
        pulls = (between(matches.poses, guess[None]) @ prior)[..., None]
        shifts = np.asarray(np.linalg.solve(matches.hessians + prior, pulls)[..., 0], dtype=np.float64)
        return compose(matches.poses, shifts)

    def _windows(self, guess: Pose, gap: Gap) -> list[tuple[Pose, Window]]:
        """Where it is sought: about the first guess and about the keyframe before, where it is if the guess
        is wrong altogether; a car that was left alone may have been turned round."""
        usual = Window(_SEARCH_REACH, _SEARCH_TURN)
        if gap == Gap.LEFT_ALONE:
            return [(guess, usual), (guess, Window(_SEARCH_REACH, np.pi))]
        return [(guess, usual), (self.here, usual)]

    def _match_guesses(self, fixed: NDArray[np.int64], guesses: Pose) -> tuple[Matches, list[int]]:
        """Where guesses (H, 3) lead, and which they were: from one near to where the first one led, matching
        would lead there again."""
        matches = self._match(fixed, guesses[:1])
        others = [k for k in range(1, len(guesses)) if are_apart(matches.poses[0], guesses[k], SAME_GUESS)]
        if others:
            matches = matches.with_more(self._match(fixed, guesses[others]))
        return matches, [0, *others]

    def _fits(self, matches: Matches) -> bool:
        """Scans that overlap but lie off each other's lines came to lie across one another: without wheels a
        fast turn ends so."""
        return bool(((matches.overlap > _LOST_OVERLAP) & self._is_on_lines(matches)).any())

    def _is_on_lines(self, matches: Matches) -> NDArray[np.bool_]:
        return matches.residual < _MAX_RESIDUAL

    def _match(self, fixed: NDArray[np.int64], guesses: Pose) -> Matches:
        count, groups = len(fixed), len(guesses)
        pairs = np.tile(np.column_stack([fixed, np.full(count, self.index)]), (groups, 1))
        starts = np.arange(groups + 1) * count
        fixed_poses = np.tile(self.poses[fixed], (groups, 1))
        pairings = Pairings(starts, pairs, fixed_poses, np.zeros((groups * count, 3)))
        prior = as_prior(self.information)
        return match(guesses, pairings, self.store, self.store, prior_information=prior)

    def _search(self, windows: Sequence[tuple[Pose, Window]]) -> list[Pose]:
        """Where in each window about a pose (3,) the keyframe lies best on the last ones, if anywhere."""
        moving = self.store.points_of(self.index).astype(np.float64)
        if len(moving) < MIN_SEARCH_POINTS:
            return []
        last = self.poses[-1]
        recent = range(max(self.known_since, self.index - _SEARCHED_AMONG), self.index)
        clouds = [transform_points(between(last, self.poses[k]), self.store.points_of(k)) for k in recent]
        fixed = LikelihoodPyramid(np.concatenate(clouds), _SEARCH_RADIUS)
        near = moving[np.abs(moving).max(axis=1) < _SEARCH_RADIUS]
        fits = [search(fixed, near, between(last, pose), window, _SEARCH_SCORE) for pose, window in windows]
        return [compose(last, fit.pose) for fit in fits if fit is not None]
