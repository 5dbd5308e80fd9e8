"""The beam sensor model of MIT's robotics course (RSS, lab 5): how likely a reading is on the map.

A mixture after Thrun, Burgard, Fox: Probabilistic Robotics (2005), section 6.3, with the course's numbers.
"""

import numpy as np
from numpy.typing import NDArray

COURSE_PIXELS = 200
"""Fixed by definition of the course, which counts distances in pixels of the map and clips them."""
_HIT_DEVIATION = 8.0
"""Pixels."""
_HIT, _SHORT, _MAX, _RANDOM = 0.74, 0.07, 0.07, 0.12
"""Shares of readings of the wall, of something before it, of the maximum and of anything."""


def beam_probabilities(longest: int = COURSE_PIXELS) -> NDArray[np.float64]:
    """(L + 1, L + 1) probability of measuring z (row) where the map says d (column), both in pixels.

    A mixture of a Gaussian about d, something before it (more likely near by), a reading of the
    maximum L, and anything at all; every column sums to 1.
    """
    measured = np.arange(longest + 1.0)[:, None]
    expected = np.arange(longest + 1.0)[None, :]
    hit = np.exp(-0.5 * ((measured - expected) / _HIT_DEVIATION) ** 2)
    hit /= hit.sum(axis=0)
    distance = np.maximum(expected, 1.0)
    short = np.where(
        (measured <= expected) & (expected > 0), 2.0 / distance * (1.0 - measured / distance), 0.0
    )
    mixed = _HIT * hit + _SHORT * short + _MAX * (measured == longest) + _RANDOM / longest
    probabilities: NDArray[np.float64] = mixed / mixed.sum(axis=0)
    return probabilities
