"""When the car is carried: it moves as ever, but its wheels stand."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

CARRY_PERIOD = 30.0
"""Seconds from the end of one time to the end of the next in which the car is carried."""


def is_carried(seconds: ArrayLike, carried: float) -> NDArray[np.bool_]:
    """(N,) whether at times (N,) of the drive: in the last ``carried`` seconds of each 30."""
    return np.asarray(np.asarray(seconds) % CARRY_PERIOD >= CARRY_PERIOD - carried)
