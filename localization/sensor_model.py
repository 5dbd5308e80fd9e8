"""The beam sensor model of MIT's robotics course (RSS, lab 5): how likely a reading is on the map."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

MAX_PIXELS = 200
"""Distances count in map pixels and are clipped here."""

HIT_DEVIATION = 8.0
"""Pixels."""
HIT, SHORT, MAX, RANDOM = 0.74, 0.07, 0.07, 0.12


def beam_probabilities() -> NDArray[np.float64]:
    """(201, 201) probability of measuring z (row) where the map says d (column), both in pixels.

    A mixture of a Gaussian about d, something in the way (more likely near by), a reading of the
    maximum, and anything at all; every column sums to 1.
    """
    measured = np.arange(MAX_PIXELS + 1.0)[:, None]
    expected = np.arange(MAX_PIXELS + 1.0)[None, :]
    hit = np.exp(-0.5 * ((measured - expected) / HIT_DEVIATION) ** 2)
    hit /= hit.sum(axis=0)
    distance = np.maximum(expected, 1.0)
    short = np.where(
        (measured <= expected) & (expected > 0), 2.0 / distance * (1.0 - measured / distance), 0.0
    )
    maximum = measured == MAX_PIXELS
    mixed = HIT * hit + SHORT * short + MAX * maximum + RANDOM / MAX_PIXELS
    probabilities: NDArray[np.float64] = mixed / mixed.sum(axis=0)
    return probabilities


@cache
def _log_probabilities() -> NDArray[np.float32]:
    logs = np.log(beam_probabilities()).astype(np.float32)
    logs.flags.writeable = False
    return logs


def beam_log_probabilities(
    ranges: NDArray[np.float64], max_range: float, resolution: float, squash: float
) -> NDArray[np.float32]:
    """(B, 201) log-probability of B ranges (metres, inf: a miss) for every expected distance in pixels.

    Already divided by ``squash``. A miss tells that nothing is within ``max_range``; where that is
    shorter than the table, all that lies beyond it explains a miss equally well.
    """
    logs = _log_probabilities()
    pixels = np.clip(np.rint(ranges / resolution), 0, MAX_PIXELS).astype(np.int64)
    rows: NDArray[np.float32] = logs[pixels]
    reach = np.rint(min(max_range / resolution, MAX_PIXELS))
    miss = np.isinf(ranges)
    rows[np.ix_(miss, np.arange(MAX_PIXELS + 1) >= reach)] = logs[MAX_PIXELS, MAX_PIXELS]
    rows /= np.float32(squash)
    return rows
