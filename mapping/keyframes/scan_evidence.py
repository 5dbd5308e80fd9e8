"""Evidence of the scans for candidate poses of a keyframe, each matched with keyframes at known poses."""

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.sensors.matching.scan_matching import Matches
from racecar.sensors.matching.scan_store import ScanStore
from racecar.sensors.matching.see_through import see_through

_MIN_JUDGED = 0.2
"""Share of judged points from which agreement has full weight. Chosen by judgement: a fifth of a scan is no
coincidence."""
_MIN_MATCHED = 0.03
"""Share of matched points from which fit has full weight. Chosen by judgement: after driving through a gap,
little of what was seen before is seen again. With 0.2, one that drove 15 m of a bare corridor was put back to
where it had been."""
_UNLIKE_SHARE = 0.1
"""Share of points that agree or disagree by chance. Chosen by judgement: people, glass, edges."""
_BY_AGREEMENT = 15.0
"""Log-odds for a pose per unit of the log-odds that a judged point is on a surface and not seen through.
Points are not independent, else it would be hundreds: measured on 3100 keyframes of aces and fr079 with scans
left out, 10 to 15 tell right places from wrong ones best."""
_BY_FIT = 20.0
"""Log-odds for a pose with all matched points on lines; against one with none. Measured likewise: 10 to
20."""


def scan_evidence(
    store: ScanStore, fixed: NDArray[np.int64], fixed_poses: Pose, moving: int, matches: Matches
) -> NDArray[np.float64]:
    """(G,) log-odds that each match of a keyframe with those ``fixed`` (F,) at poses (F, 3) is right.

    Evidence for a pose is, first, that points lie on known surfaces and are not seen through, and second,
    that they lie on lines and not across them. Overlap matters only where it is too small to judge: in a
    corridor, it is largest where the car did not move at all.
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
