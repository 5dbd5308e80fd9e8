"""The odds that a scan is one from a wrong place."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def evidence_against(
    shares: NDArray[np.float64],
    when_tracked: NDArray[np.float64],
    least: NDArray[np.float64],
    log_when_lost: NDArray[np.float64],
    prior: NDArray[np.float64],
    beams: float,
) -> float:
    """Log-odds against a place, by as many beams of which shares (4,) were sorted by how they agree.

    At the right place the shares are ``when_tracked`` (4,), of which none is taken for less than ``least``
    (4,), and at a wrong one they are, by their prior odds (K,), one of those whose logarithms (K, 4) are.
    """
    total = 0.0
    for part in range(4):
        total += max(when_tracked[part], least[part])
    log_tracked = 0.0
    for part in range(4):
        log_tracked += shares[part] * math.log(max(when_tracked[part], least[part]) / total)
    odds = 0.0
    for kind in range(len(prior)):
        log_lost = 0.0
        for part in range(4):
            log_lost += shares[part] * log_when_lost[kind, part]
        odds += prior[kind] * math.exp(beams * (log_lost - log_tracked))
    return math.log(odds)
