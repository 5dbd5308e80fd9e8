"""Stands in which the car may have been carried without a trace.

A car that stands sees again what it saw; so does one that is carried along bare walls, its wheels standing.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.quality.finished_map import FinishedMap

_LEAST_STEP = 0.05
"""Metres, below which a step tells no pace, because a car that turns on the spot has none; by judgement."""

MOST_UNSEEN_WAY = 3.0
"""Metres that a car may be carried unseen. By judgement: six times what a good map may err. Robots that stood
in the corridors of aces, fr079, intel and a hall had at most 0.8 m."""


def unseen_stands(
    map_: FinishedMap,
    has_wheels: NDArray[np.bool_],
    are_bare: NDArray[np.bool_],
    are_closed: NDArray[np.bool_],
) -> NDArray[np.float64]:
    """(K - 1,) metres that the car would have gone at the usual pace of the drive while it stood within each
    step, where only the wheels tell that it did: the keyframe after it ``has_wheels`` (K,), walls at one of
    its ends ``are_bare`` (K,), and no loop closure spans it, of steps that ``are_closed`` (K - 1,) or not.
    Before its first step every car stands, and nothing is said of that."""
    steps, seconds = np.diff(map_.path), np.nan_to_num(np.diff(map_.seconds))
    tells_pace = (steps > _LEAST_STEP) & (seconds > 0.0)
    if not tells_pace.any():
        return np.zeros(len(steps))
    pace = np.median(steps[tells_pace] / seconds[tells_pace])
    untold = (are_bare[1:] | are_bare[:-1]) & has_wheels[1:] & ~are_closed
    untold[np.argmax(np.isfinite(map_.seconds[:-1]))] = False
    stands: NDArray[np.float64] = np.where(untold, np.maximum(pace * seconds - steps, 0.0), 0.0)
    return stands
