"""The beam sensor model of MIT's robotics course (RSS, lab 5): how likely a reading is on the map."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from racecar.localization.floor.range_table.range_codes import RANGE_STEP, RangeCodes
from racecar.localization.sensor.config import COURSE, BeamModelConfig

COURSE_PIXELS = 200
"""Fixed by definition of the course, which counts distances in pixels of the map, steps of 5 cm here, and
clips them."""


def beam_probabilities(
    longest: int = COURSE_PIXELS, mixture: BeamModelConfig = COURSE
) -> NDArray[np.float64]:
    """(L + 1, L + 1) probability of measuring z (row) where the map says d (column), both in steps of 5 cm.

    A mixture of a Gaussian about d, something before it (more likely near by), a reading of the
    maximum L, and anything at all; every column sums to 1.
    """
    measured = np.arange(longest + 1.0)[:, None]
    expected = np.arange(longest + 1.0)[None, :]
    hit = np.exp(-0.5 * ((measured - expected) / (mixture.hit_deviation / RANGE_STEP)) ** 2)
    hit /= hit.sum(axis=0)
    distance = np.maximum(expected, 1.0)
    short = np.where(
        (measured <= expected) & (expected > 0), 2.0 / distance * (1.0 - measured / distance), 0.0
    )
    maximum = measured == longest
    mixed = mixture.hit * hit + mixture.short * short + mixture.max * maximum + mixture.random / longest
    probabilities: NDArray[np.float64] = mixed / mixed.sum(axis=0)
    return probabilities


def beam_log_probabilities(
    ranges: NDArray[np.float64], max_range: float, squash: float, mixture: BeamModelConfig, codes: RangeCodes
) -> NDArray[np.float32]:
    """(B, 256) log-probability of B ranges (metres, inf: a miss) for the code of every expected range."""
    table = log_probability_table(max_range, squash, mixture, codes, 0)
    return table[rows_of(ranges, table)]


def rows_of(ranges: NDArray[np.float64], table: NDArray[np.float32]) -> NDArray[np.int64]:
    """(B,) rows of a table of log-probabilities for B ranges (metres, inf: a miss)."""
    steps = np.minimum(ranges / RANGE_STEP + 0.5, len(table) - 1)
    return steps.astype(np.int64)


def log_probability_table(
    max_range: float, squash: float, mixture: BeamModelConfig, codes: RangeCodes, margin: int
) -> NDArray[np.float32]:
    """(L + 1, margin + 256 + margin): a row for each reading in steps of 5 cm, a column for each code of an
    expected range, the first and the last repeated.

    Log-probabilities, already divided by ``squash``. Readings and expectations are clipped to the sensor's
    range (metres), or to that of the codes where it is shorter.
    """
    reach, longest = max_range / RANGE_STEP, codes.longest_steps
    return _log_probabilities(
        max(1, round(reach)) if reach < longest else longest, squash, mixture, codes, margin
    )


@lru_cache(maxsize=4)
def _log_probabilities(
    longest: int, squash: float, mixture: BeamModelConfig, codes: RangeCodes, margin: int
) -> NDArray[np.float32]:
    expected = np.minimum(np.rint(np.pad(codes.steps, margin, mode="edge")), longest).astype(np.int64)
    logs = np.log(beam_probabilities(longest, mixture)[:, expected]) / squash
    return np.ascontiguousarray(logs, dtype=np.float32)
