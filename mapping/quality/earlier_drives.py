"""Compare the last drive with what earlier drives saw at the same places.

Objects are moved between drives, so at some places it sees through what was there before. A drive that was
merged at a wrong place does so nearly everywhere.
"""

import numpy as np

from racecar.mapping.quality.finished_map import FinishedMap
from racecar.mapping.quality.pass_agreement import agreement_of, near_pairs

MOST_UNLIKE = 0.3
"""Share of earlier drives' points that the last one may see through at most places. Measured where half of
the furniture was moved between drives: 0.1; with the last one 0.2 m off 0.26, with 0.5 m or 3 degrees 0.4 to
0.8."""


def unlike_earlier(map_: FinishedMap) -> float:
    """Median over places of the share of earlier drives' points that the last one sees through, or vice
    versa; NaN without common places."""
    _, pairs = near_pairs(map_)
    first = map_.first_of_last_drive
    of_both = pairs[(pairs[:, 0] < first) & (pairs[:, 1] >= first)]
    passes = agreement_of(of_both, map_.poses, map_.session.keyframes)
    places = passes.by_places(np.zeros(len(of_both)), map_.path)
    shares = places.looked_through[places.are_seen]
    return float(np.median(shares)) if len(shares) else float("nan")
