"""Which sweeps a logger keeps: a slow one few of them, a bad one none for a while."""

import numpy as np
from numpy.typing import NDArray

from racecar.pipelines.simulation.driver import TICK

GAP_PERIOD = 15.0
"""Seconds from the end of one gap to the end of the next, as logs have them whose disk is too slow."""


def kept_ticks(ticks: NDArray[np.int64], every: float, gaps: float) -> NDArray[np.int64]:
    """Of ticks (S,), at which sweeps begin, those whose sweeps are written (K,).

    One is kept at most per ``every`` seconds, and none in the last ``gaps`` seconds of each 15.
    """
    seconds = TICK * ticks
    written = ticks[seconds % GAP_PERIOD < GAP_PERIOD - gaps]
    if every == 0.0:
        return written
    period = round(every / TICK)
    kept, due = [], 0
    for tick in written.tolist():
        if tick >= due:
            kept.append(tick)
            due = tick + period
    return np.array(kept, dtype=np.int64)
