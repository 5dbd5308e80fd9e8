"""Keyframes: choose them, place them against the ones before, and tie them together with constraints."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import Constraint, Kind
from racecar.mapping.matching.correlative_search import LikelihoodPyramid, Window, search
from racecar.mapping.matching.match_information import as_prior, match_information
from racecar.mapping.matching.scan_matching import Matches, Pairings, match, one_to_one
from racecar.mapping.matching.scan_store import ScanStore
from racecar.mapping.matching.see_through import see_through
from racecar.maps.geometry.se2 import Pose, are_apart, between, compose, transform_points

PLACED_AGAINST = (1, 2, 4, 7, 11)
TIED_TO = (1, 2, 4, 7, 11, 16, 22, 30)
"""Keyframes back along the path. Wide spacing halves the drift compared with the next eight."""
SAME_GUESS = (0.1, 0.05)
"""Metres and radians, from within which matching leads to the same place."""
CLEARLY_BETTER = 1.25
FIT_OVERLAP = 0.1
FIT_RESIDUAL = 0.02
LOST_BELOW = 0.2
SEARCHED_AMONG = 12
SEARCH_WINDOW = Window(1.5, np.deg2rad(45.0))
ALL_ROUND = Window(SEARCH_WINDOW.reach, np.pi)
SEARCH_RADIUS = 20.0
SEARCH_SCORE = 0.4
MIN_SEARCH_POINTS = 30
MIN_OVERLAP = 0.15
MAX_RESIDUAL = 0.04
_TIED_WITHIN = 0.3
"""Metres within which partners are sought of scans that have been placed."""


def place(
    index: int,
    guesses: Pose,
    information: NDArray[np.float64],
    store: ScanStore,
    poses: Pose,
    known_since: int = 0,
) -> tuple[Pose, int]:
    """Pose (3,) of keyframe ``index``, matched jointly against several before it, from guesses (H, 3).

    Also tells which guess led there. ``information`` (3, 3) is what the guesses are worth, in the
    frame of the keyframe. When the scans fit nowhere near, they are sought in wide windows about the first
    guess and about the keyframe before. Keyframes before ``known_since`` are elsewhere.
    """
    spaced, recent = _spaced(index, known_since), _recent(index, known_since)
    placed, chosen, fits = _match_best(index, spaced, guesses, information, store, poses)
    if fits:
        return placed, chosen
    windows = [(guesses[0], SEARCH_WINDOW), (poses[index - 1], SEARCH_WINDOW)]
    found = [pose for pose in _search(index, recent, windows, store, poses) if pose is not None]
    if not found:
        return placed, chosen
    extended = np.concatenate([guesses, found])
    placed, chosen, _ = _match_best(index, spaced, extended, information, store, poses)
    return placed, chosen if chosen < len(guesses) else 0


def place_left_alone(
    index: int,
    guesses: Pose,
    information: NDArray[np.float64],
    store: ScanStore,
    poses: Pose,
    known_since: int = 0,
) -> tuple[Pose, int]:
    """The same of the first keyframe after a gap in which the car stood: it may have been moved by hand.

    So it is always sought, also facing any way; but that way it must fit clearly better, for corridors look
    alike both ways.
    """
    spaced, recent = _spaced(index, known_since), _recent(index, known_since)
    placed, chosen, _ = _match_best(index, spaced, guesses, information, store, poses)
    windows = [(guesses[0], SEARCH_WINDOW), (guesses[0], ALL_ROUND)]
    nearby, turned = _search(index, recent, windows, store, poses)
    for found, least_gain in ((nearby, 1.0), (turned, CLEARLY_BETTER)):
        better = _better(index, spaced, placed, found, least_gain, information, store, poses)
        if better is not None:
            placed, chosen = better, 0
    return placed, chosen


def place_far(
    index: int, guesses: Pose, information: NDArray[np.float64], store: ScanStore, poses: Pose
) -> tuple[Pose, int]:
    """The same of a keyframe that is far from the last one: the car drove on while no scans came.

    It is matched against those where it should be by now, and not sought in a wide window there, in which
    many a place may look alike. Wheels that began anew tell of a way that was none: so it is matched against
    the last ones too, and sought about them where it fits nowhere.
    """
    held = np.flatnonzero(store.is_kept[:index])
    distances = np.hypot(*(poses[held] - guesses[0])[:, :2].T)
    near = held[np.argsort(distances, kind="stable")[:SEARCHED_AMONG]]
    fixed = np.union1d(near, _spaced(index, 0))
    placed, chosen, fits = _match_best(index, fixed, guesses, information, store, poses)
    if fits:
        return placed, chosen
    (found,) = _search(index, _recent(index, 0), [(poses[index - 1], SEARCH_WINDOW)], store, poses)
    better = _better(index, fixed, placed, found, CLEARLY_BETTER, information, store, poses)
    return (placed, chosen) if better is None else (better, 0)


def _better(
    index: int,
    fixed: NDArray[np.int64],
    placed: Pose,
    found: Pose | None,
    least_gain: float,
    information: NDArray[np.float64],
    store: ScanStore,
    poses: Pose,
) -> Pose | None:
    """Where a pose (3,) that was found leads, if the scans fit so many times better there than where keyframe
    ``index`` is placed.

    Scans that share little of their view fit by chance here and there: how much of the rest they look through
    tells.
    """
    if found is None:
        return None
    matches = _match_guesses(index, fixed, np.stack([placed, found]), information, store, poses)
    pairs = np.column_stack([fixed, np.full(len(fixed), index)])
    tests = [
        see_through(store, pairs, poses[fixed], np.tile(pose, (len(fixed), 1))) for pose in matches.poses
    ]
    before, after = matches.weight * [test.agreement for test in tests]
    return matches.poses[1] if after > least_gain * before else None


def _spaced(index: int, known_since: int) -> NDArray[np.int64]:
    return np.array([index - back for back in PLACED_AGAINST if back <= index - known_since])


def _recent(index: int, known_since: int) -> NDArray[np.int64]:
    return np.arange(max(known_since, index - SEARCHED_AMONG), index)


def _match_best(
    index: int,
    fixed: NDArray[np.int64],
    guesses: Pose,
    information: NDArray[np.float64],
    store: ScanStore,
    poses: Pose,
) -> tuple[Pose, int, bool]:
    """The pose (3,) to which the best of guesses (H, 3) leads, which guess that is, and whether scans fit.

    From a guess near to where the first one led, matching would lead there again. Scans that overlap but lie
    off each other's lines came to lie across one another: without wheels a fast turn ends so.
    """
    matches = _match_guesses(index, fixed, guesses[:1], information, store, poses)
    others = [k for k in range(1, len(guesses)) if differ(matches.poses[0], guesses[k])]
    if others:
        matches = matches.with_more(_match_guesses(index, fixed, guesses[others], information, store, poses))
    best = _best(matches)
    fits = matches.overlap.max() > LOST_BELOW and matches.residual[best] < FIT_RESIDUAL
    return matches.poses[best], [0, *others][best], bool(fits)


def differ(guess: Pose, other: Pose) -> bool:
    """Are two guesses (3,) so far apart that matching may lead elsewhere from each?"""
    return are_apart(guess, other, SAME_GUESS)


def _match_guesses(
    index: int,
    fixed: NDArray[np.int64],
    guesses: Pose,
    information: NDArray[np.float64],
    store: ScanStore,
    poses: Pose,
) -> Matches:
    count, groups = len(fixed), len(guesses)
    pairs = np.tile(np.column_stack([fixed, np.full(count, index)]), (groups, 1))
    starts = np.arange(groups + 1) * count
    pairings = Pairings(starts, pairs, np.tile(poses[fixed], (groups, 1)), np.zeros((groups * count, 3)))
    return match(guesses, pairings, store, store, prior_information=as_prior(information))


def _best(matches: Matches) -> int:
    """A later guess wins only where the scans fit clearly better from it than from the first: along an arc
    or a bare corridor they fit nearly everywhere, and best where the car did not move at all."""
    best = int(np.argmax(matches.weight))
    fits = matches.overlap[best] > FIT_OVERLAP and matches.residual[best] < FIT_RESIDUAL
    return best if fits and matches.weight[best] > CLEARLY_BETTER * matches.weight[0] else 0


def _search(
    index: int,
    recent: NDArray[np.int64],
    windows: Sequence[tuple[Pose, Window]],
    store: ScanStore,
    poses: Pose,
) -> list[Pose | None]:
    """Where in each window about a pose (3,) keyframe ``index`` lies best on the last ones, if anywhere."""
    clouds = [transform_points(between(poses[index - 1], poses[k]), store.points_of(int(k))) for k in recent]
    moving = store.points_of(index).astype(np.float64)
    if len(moving) < MIN_SEARCH_POINTS:
        return [None] * len(windows)
    fixed = LikelihoodPyramid(np.concatenate(clouds), SEARCH_RADIUS)
    near = moving[np.abs(moving).max(axis=1) < SEARCH_RADIUS]
    last = poses[index - 1]
    fits = [search(fixed, near, between(last, pose), window, SEARCH_SCORE) for pose, window in windows]
    return [None if fit is None else compose(last, fit.pose) for fit in fits]


def constrain(pairs: NDArray[np.int64], poses: Pose, store: ScanStore) -> list[Constraint]:
    """Scan matching constraints of keyframe pairs (P, 2), earlier and later; poor matches are left out."""
    if len(pairs) == 0:
        return []
    guesses = between(poses[pairs[:, 0]], poses[pairs[:, 1]])
    matches = match(guesses, one_to_one(pairs), store, store, initial_distance=_TIED_WITHIN)
    good = (matches.overlap > MIN_OVERLAP) & (matches.residual < MAX_RESIDUAL)
    return [_constraint(pairs[k], matches, int(k), "scan_matching") for k in np.flatnonzero(good)]


def _constraint(pair: NDArray[np.int64], matches: Matches, k: int, kind: Kind) -> Constraint:
    information = match_information(matches.hessians[k], float(matches.residual[k]))
    return Constraint(int(pair[0]), int(pair[1]), matches.poses[k], information, kind)
