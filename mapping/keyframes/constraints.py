"""Scan matching constraints between keyframes."""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.graph.constraint import Constraint
from racecar.maps.geometry.se2 import Pose, between
from racecar.sensors.matching.match_information import match_information
from racecar.sensors.matching.scan_matching import Matches, match, one_to_one
from racecar.sensors.matching.scan_store import ScanStore

LOOKBACK = (1, 2, 4, 7, 11, 16, 22, 30)
"""Each keyframe is matched with these predecessors, counted back along the path. Measured on aces, fr079 and
intel: before any loop is closed, wide spacing halves the drift compared with the last eight."""
_INITIAL_DISTANCE = 0.3
"""Initial correspondence distance in metres. Chosen by judgement: both keyframes were placed before."""
MIN_OVERLAP = 0.06
"""Minimum share of points with a correspondence. How little few points show is in a match's information:
measured on a simulated campus, where a third of the keyframes share less than 0.15, such matches err by as
many of their standard deviations as the others, and down to 0.03 take the mean error from 0.086 to 0.024 m
(python -m benchmarks worlds). Where a race car's wheels know no turns, 0.05 and less once led 4 degrees
astray (test_gyroscope)."""
MAX_RESIDUAL = 0.04
"""Maximum weighted root mean square point-to-line distance of a match, in metres. Chosen by judgement: as
much as a straight surface may deviate from a line."""


def pairs_along_path(keyframes: range) -> NDArray[np.int64]:
    """(P, 2) pairs of some keyframes with the predecessors along the path they are matched with."""
    pairs = [(k - back, k) for k in keyframes for back in LOOKBACK if back <= k]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def constrain(pairs: NDArray[np.int64], poses: Pose, store: ScanStore) -> list[Constraint]:
    """Scan matching constraints of keyframe pairs (P, 2), earlier and later; poor matches are skipped.

    Matching starts from the poses (K, 3) of all keyframes.
    """
    if len(pairs) == 0:
        return []
    return constraints_of(pairs, *match_pairs(pairs, poses, store), store)


def constraints_of(
    pairs: NDArray[np.int64], matches: Matches, good: NDArray[np.bool_], store: ScanStore
) -> list[Constraint]:
    """Constraints of keyframe pairs (P, 2) from their ``good`` (P,) matches."""
    return [
        Constraint(
            int(pairs[k, 0]),
            int(pairs[k, 1]),
            matches.poses[k],
            match_information(matches.hessians[k], float(matches.residual[k])),
            "scan_matching",
        )
        for k in np.flatnonzero(good)
    ]


def match_pairs(pairs: NDArray[np.int64], poses: Pose, store: ScanStore) -> tuple[Matches, NDArray[np.bool_]]:
    """Matches of keyframe pairs (P, 2), starting from the poses (K, 3) of all keyframes, and (P,) whether
    each is good enough."""
    guesses = between(poses[pairs[:, 0]], poses[pairs[:, 1]])
    matches = match(guesses, one_to_one(pairs), store, store, initial_distance=_INITIAL_DISTANCE)
    good = (matches.overlap > MIN_OVERLAP) & (matches.residual < MAX_RESIDUAL)
    return matches, good
