"""Detect jumps of the path, where similar places were mistaken for each other."""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.quality.finished_map import FinishedMap
from racecar.maps.geometry.se2 import compose

_USUAL = 0.95
"""Quantile of the speed taken as the usual maximum, because a jump must not excuse itself."""
_FASTER = 1.5
"""Factor by which a car may exceed that. Measured on 106 maps: with both, good ones jump by 0.16 m at most,
and one with eight wrong loops by 7 m."""

MOST_JUMP = 0.5
"""Metres by which a step may exceed what a car can drive. Chosen by judgement: what a good map may err."""


def jumps(map_: FinishedMap) -> NDArray[np.float64]:
    """(K - 1,) metres by which each step exceeds what the car can drive in that time, by its own speeds; 0
    where the time is unknown."""
    map_from_base = compose(map_.poses, map_.session.keyframe_from_base)
    steps, seconds = np.hypot(*np.diff(map_from_base[:, :2], axis=0).T), map_.seconds_of_steps
    is_timed = seconds > 0.0
    if not is_timed.any():
        return np.zeros(len(steps))
    fastest = _FASTER * np.quantile(steps[is_timed] / seconds[is_timed], _USUAL)
    beyond: NDArray[np.float64] = np.where(is_timed, np.maximum(steps - fastest * seconds, 0.0), 0.0)
    return beyond
