"""The beam sensor model of MIT's robotics course (RSS, lab 5): how likely a reading is on the map."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from localization.range_codes import CELLS_OF_CODE, FARTHEST

COURSE_PIXELS = 200
"""The course counts distances in map pixels and clips them here."""


@dataclass(frozen=True)
class BeamMixture:
    """What a reading can be: the wall, something before it, the maximum, anything; here by the course."""

    hit_deviation: float = 8.0
    """Pixels."""
    hit: float = 0.74
    short: float = 0.07
    max: float = 0.07
    random: float = 0.12


COURSE = BeamMixture()
TRACKING = BeamMixture(hit_deviation=4.0, random=1.2)
"""Sharper at the wall, as bends and bare corridors need, and more forgiving of what the map does not know."""


def beam_probabilities(max_pixels: int = COURSE_PIXELS, mixture: BeamMixture = COURSE) -> NDArray[np.float64]:
    """(P + 1, P + 1) probability of measuring z (row) where the map says d (column), both in pixels.

    A mixture of a Gaussian about d, something in the way (more likely near by), a reading of the
    maximum P, and anything at all; every column sums to 1.
    """
    measured = np.arange(max_pixels + 1.0)[:, None]
    expected = np.arange(max_pixels + 1.0)[None, :]
    hit = np.exp(-0.5 * ((measured - expected) / mixture.hit_deviation) ** 2)
    hit /= hit.sum(axis=0)
    distance = np.maximum(expected, 1.0)
    short = np.where(
        (measured <= expected) & (expected > 0), 2.0 / distance * (1.0 - measured / distance), 0.0
    )
    maximum = measured == max_pixels
    mixed = mixture.hit * hit + mixture.short * short + mixture.max * maximum + mixture.random / max_pixels
    probabilities: NDArray[np.float64] = mixed / mixed.sum(axis=0)
    return probabilities


def beam_log_probabilities(
    ranges: NDArray[np.float64], max_range: float, resolution: float, squash: float, mixture: BeamMixture
) -> NDArray[np.float32]:
    """(B, 256) log-probability of B ranges (metres, inf: a miss) for the code of every expected range.

    Already divided by ``squash``. Readings and expectations are clipped to the sensor's range, or to the
    table's where that is shorter.
    """
    reach = max_range / resolution
    max_pixels = max(1, round(reach)) if reach < FARTHEST else FARTHEST
    pixels = np.clip(np.rint(ranges / resolution), 0, max_pixels).astype(np.int64)
    logs: NDArray[np.float32] = _log_probabilities(max_pixels, squash, mixture)[pixels]
    return logs


@lru_cache(maxsize=4)
def _log_probabilities(max_pixels: int, squash: float, mixture: BeamMixture) -> NDArray[np.float32]:
    """(P + 1, 256) a row for each reading, a column for each code of an expected range."""
    expected = np.minimum(np.rint(CELLS_OF_CODE), max_pixels).astype(np.int64)
    logs = (np.log(beam_probabilities(max_pixels, mixture)[:, expected]) / squash).astype(np.float32)
    logs.flags.writeable = False
    return logs
