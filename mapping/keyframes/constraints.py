"""Constraints between keyframes by scan matching."""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import Constraint
from racecar.mapping.keyframes.config import ConstraintConfig
from racecar.mapping.matching.match_information import match_information
from racecar.mapping.matching.scan_matching import Matches, match, one_to_one
from racecar.mapping.matching.scan_store import ScanStore
from racecar.maps.geometry.se2 import Pose, between

_DEFAULT = ConstraintConfig()


def pairs_along_path(keyframes: range, config: ConstraintConfig = _DEFAULT) -> NDArray[np.int64]:
    """(P, 2) each of some keyframes with those before it along the path to which it is tied."""
    pairs = [(k - back, k) for k in keyframes for back in config.tied_to if back <= k]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def constrain(
    pairs: NDArray[np.int64], poses: Pose, store: ScanStore, config: ConstraintConfig = _DEFAULT
) -> list[Constraint]:
    """Scan matching constraints of keyframe pairs (P, 2), earlier and later; poor matches are left out.

    The poses (K, 3) are those of all keyframes, from which matching begins.
    """
    if len(pairs) == 0:
        return []
    return constraints_of(pairs, *match_pairs(pairs, poses, store, config), store)


def constraints_of(
    pairs: NDArray[np.int64], matches: Matches, good: NDArray[np.bool_], store: ScanStore
) -> list[Constraint]:
    """Constraints of keyframe pairs (P, 2) by those of their matches that are ``good`` (P,)."""
    return [
        Constraint(
            int(pairs[k, 0]),
            int(pairs[k, 1]),
            matches.poses[k],
            match_information(matches.hessians[k], float(matches.residual[k]), store.config.point_to_line),
            "scan_matching",
        )
        for k in np.flatnonzero(good)
    ]


def match_pairs(
    pairs: NDArray[np.int64], poses: Pose, store: ScanStore, config: ConstraintConfig = _DEFAULT
) -> tuple[Matches, NDArray[np.bool_]]:
    """The matches of keyframe pairs (P, 2), from the poses (K, 3) of all keyframes, and (P,) whether each is
    good enough to count."""
    guesses = between(poses[pairs[:, 0]], poses[pairs[:, 1]])
    matches = match(guesses, one_to_one(pairs), store, store, initial_distance=config.initial_distance)
    good = (matches.overlap > config.min_overlap) & (matches.residual < config.max_residual)
    return matches, good
