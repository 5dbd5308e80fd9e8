"""Does the last drive see what earlier drives saw at the same places?

Things are moved between drives, so that at some places it looks through what was there before; a drive that
was joined at a wrong place does so nearly everywhere.
"""

import numpy as np

from racecar.mapping.quality.config import QualityConfig
from racecar.mapping.quality.finished_map import FinishedMap
from racecar.mapping.quality.pass_agreement import agreement_of, near_pairs


def unlike_earlier(map_: FinishedMap, config: QualityConfig) -> float:
    """Share of what earlier drives saw that the last one looks through at half of the places or more, or the
    other way round; NaN where they share none."""
    _, pairs = near_pairs(map_, config.passes)
    first = map_.first_of_last_drive
    of_both = pairs[(pairs[:, 0] < first) & (pairs[:, 1] >= first)]
    passes = agreement_of(of_both, map_.poses, map_.session.keyframes)
    places = passes.by_places(np.zeros(len(of_both)), map_.path, config.segments.length)
    shares = places.looked_through[places.judged > config.segments.min_judged]
    return float(np.median(shares)) if len(shares) else float("nan")
