"""What scans say of places where a keyframe may lie, each matched with keyframes whose places are known."""

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.sensors.matching.scan_matching import Matches
from racecar.sensors.matching.scan_store import ScanStore
from racecar.sensors.matching.see_through import see_through

_MIN_JUDGED = 0.2
"""Share of the points that must be judged for their word to count in full, by judgement: a fifth of a scan is
no chance."""
_MIN_MATCHED = 0.03
"""Share of the points that must be matched for their fit to count in full. By judgement: where the car drove
on while scans were missing, little of what it saw before is seen again. With 0.2, one that drove 15 m of a
bare corridor was put back to where it had been."""
_UNLIKE_SHARE = 0.1
"""Share of the points that may lie either way whatever is true. By judgement: people, glass, edges."""
_BY_AGREEMENT = 15.0
"""Log-odds for a place, per unit of the log-odds that a judged point lies on a surface and is not looked
through. Points are not independent, else it would be hundreds: measured on 3100 keyframes of aces and fr079
with scans left out, 10 to 15 tell right places from wrong ones best."""
_BY_FIT = 20.0
"""Log-odds for a place where all matched points lie on lines, and against one where none does. Measured
likewise: 10 to 20."""


def scan_evidence(
    store: ScanStore, fixed: NDArray[np.int64], fixed_poses: Pose, moving: int, matches: Matches
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
    log_odds = np.log((agreement + _UNLIKE_SHARE) / (1.0 - agreement + _UNLIKE_SHARE))
    by_agreement = _BY_AGREEMENT * log_odds * np.minimum(1.0, judged / _MIN_JUDGED)
    by_fit = _BY_FIT * (2.0 * on_lines - 1.0)
    met = np.minimum(1.0, matches.overlap / _MIN_MATCHED)
    return np.asarray(by_agreement + met * by_fit, dtype=np.float64)
