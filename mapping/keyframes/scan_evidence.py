"""What scans say of places where a keyframe may lie, each matched with keyframes whose places are known."""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.keyframes.config import ScanEvidenceConfig
from racecar.mapping.matching.scan_matching import Matches
from racecar.mapping.matching.scan_store import ScanStore
from racecar.mapping.matching.see_through import see_through
from racecar.maps.geometry.se2 import Pose


def scan_evidence(
    store: ScanStore,
    fixed: NDArray[np.int64],
    fixed_poses: Pose,
    moving: int,
    matches: Matches,
    config: ScanEvidenceConfig,
) -> NDArray[np.float64]:
    """(G,) log-odds that each match of a keyframe with those ``fixed`` (F,) at their poses (F, 3) is right.

    Two things speak for a place: that what is seen from there lies where it was seen before, and is not
    looked through; and that it lies on lines, not across them. How much the scans share counts only where it
    is too little to judge: along a corridor they share most where the car did not move at all.
    """
    pairs = np.column_stack([fixed, np.full(len(fixed), moving)])
    tests = [see_through(store, pairs, fixed_poses, np.tile(pose, (len(fixed), 1))) for pose in matches.poses]
    agreement = np.array([test.agreement for test in tests])
    points = max(sum(len(store.points_of(k)) for k in pairs.ravel()), 1)
    judged = np.array([test.on_surface + test.looked_through for test in tests]) / points
    on_lines = matches.weight / np.maximum(matches.overlap * points, 1.0)
    log_odds = np.log((agreement + config.unlike_share) / (1.0 - agreement + config.unlike_share))
    by_agreement = config.by_agreement * log_odds * np.minimum(1.0, judged / config.min_judged)
    by_fit = config.by_fit * (2.0 * on_lines - 1.0)
    met = np.minimum(1.0, matches.overlap / config.min_matched)
    return np.asarray(by_agreement + met * by_fit, dtype=np.float64)
