"""Keyframes: choose them, place them against the ones before, and tie them together with constraints."""

import numpy as np
from numpy.typing import NDArray

from mapping.constraint import Constraint, Kind
from mapping.scan_matching import Matches, Pairings, match, one_to_one
from mapping.scan_store import ScanStore
from maps.se2 import Pose, between

PLACED_AGAINST = (1, 2, 4, 7, 11)
TIED_TO = (1, 2, 4, 7, 11, 16, 22, 30)
"""Keyframes back along the path. Wide spacing halves the drift compared with the next eight."""
CLEARLY_BETTER = 1.15
MIN_OVERLAP = 0.15
MAX_RESIDUAL = 0.04
_USUAL_RESIDUAL = 0.01
_INFORMATION_SCALE = 0.1
"""Neighbouring beams, and the same scan in many pairs, err together: each term counts for a tenth."""
_REGULAR = 1e-3 * np.eye(3)


def place(
    index: int, guesses: Pose, information: NDArray[np.float64], store: ScanStore, poses: Pose
) -> Pose:
    """Pose (3,) of keyframe ``index``, matched jointly against several before it, from guesses (H, 3).

    ``information`` (3,) is what the guesses are worth, diagonal, in the frame of the keyframe.
    A later guess wins only where the scans fit clearly better there than from the first: along an arc or a
    bare corridor they fit everywhere, and tell nothing.
    """
    fixed = np.array([index - back for back in PLACED_AGAINST if back <= index])
    pairs = np.column_stack([fixed, np.full(len(fixed), index)])
    count, groups = len(fixed), len(guesses)
    pairings = Pairings(
        np.arange(groups + 1) * count, np.tile(pairs, (groups, 1)), np.tile(poses[fixed], (groups, 1)),
        np.zeros((groups * count, 3)),
    )
    prior = information * _USUAL_RESIDUAL**2 / _INFORMATION_SCALE
    matches = match(guesses, pairings, store, store, prior_information=prior)
    best = int(np.argmax(matches.weight))
    if matches.weight[best] < CLEARLY_BETTER * matches.weight[0]:
        best = 0
    placed: Pose = matches.poses[best]
    return placed


def constrain(
    pairs: NDArray[np.int64], poses: Pose, store: ScanStore, widest: float, max_change: float = np.inf
) -> list[Constraint]:
    """Scan matching constraints of keyframe pairs (P, 2), earlier and later; poor matches are left out."""
    if len(pairs) == 0:
        return []
    guesses = between(poses[pairs[:, 0]], poses[pairs[:, 1]])
    matches = match(guesses, one_to_one(pairs), store, store, widest=widest)
    changed = np.hypot(*(between(guesses, matches.poses)[:, :2]).T)
    good = (matches.overlap > MIN_OVERLAP) & (matches.residual < MAX_RESIDUAL) & (changed < max_change)
    return [_constraint(pairs[k], matches, int(k), "scan_matching") for k in np.flatnonzero(good)]


def match_information(hessian: NDArray[np.float64], residual: float) -> NDArray[np.float64]:
    """(3, 3) information of a match from its Hessian for unit residuals and the residual it ended with."""
    return hessian * (_INFORMATION_SCALE / max(residual, _USUAL_RESIDUAL) ** 2) + _REGULAR


def _constraint(pair: NDArray[np.int64], matches: Matches, k: int, kind: Kind) -> Constraint:
    information = match_information(matches.hessians[k], float(matches.residual[k]))
    return Constraint(int(pair[0]), int(pair[1]), matches.poses[k], information, kind)
