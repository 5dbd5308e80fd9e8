"""The beam sensor model of MIT's robotics course (RSS, lab 5): how likely a reading is on the map."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from racecar.localization.floor.range_table.range_codes import CELLS_OF_CODE, FARTHEST

MARGIN = 3
"""Codes that a correction may go beyond those there are."""
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
    """(B, 256) log-probability of B ranges (metres, inf: a miss) for the code of every expected range."""
    table = log_probability_table(max_range, resolution, squash, mixture)
    return table[readings_in(table, ranges, resolution), MARGIN:-MARGIN]


def readings_in(
    table: NDArray[np.float32], ranges: NDArray[np.float64], resolution: float
) -> NDArray[np.int64]:
    """(B,) rows of a table of log-probabilities for B ranges (metres, inf: a miss)."""
    pixels = np.minimum(ranges / resolution + 0.5, len(table) - 1)
    return pixels.astype(np.int64)


def log_probability_table(
    max_range: float, resolution: float, squash: float, mixture: BeamMixture
) -> NDArray[np.float32]:
    """(P + 1, MARGIN + 256 + MARGIN): a row for each reading in pixels, a column for each code of an expected
    range, the first and the last repeated.

    Log-probabilities, already divided by ``squash``. Readings and expectations are clipped to the sensor's
    range, or to the table's of ranges where that is shorter.
    """
    reach = max_range / resolution
    return _log_probabilities(max(1, round(reach)) if reach < FARTHEST else FARTHEST, squash, mixture)


@lru_cache(maxsize=4)
def _log_probabilities(max_pixels: int, squash: float, mixture: BeamMixture) -> NDArray[np.float32]:
    expected = np.minimum(np.rint(np.pad(CELLS_OF_CODE, MARGIN, mode="edge")), max_pixels).astype(np.int64)
    logs = np.log(beam_probabilities(max_pixels, mixture)[:, expected]) / squash
    return np.ascontiguousarray(logs, dtype=np.float32)
