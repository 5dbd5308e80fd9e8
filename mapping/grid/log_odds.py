"""Occupancy from hits and passes by log odds.

Moravec and Elfes, "High resolution maps from wide angle sonar", ICRA 1985; observations of a cell by
different scans count as independent.
"""

import numpy as np
from numpy.typing import NDArray

from racecar.mapping.grid.config import RenderingConfig
from racecar.maps.grid.occupancy_grid import FREE_THRESHOLD, UNKNOWN

_SETTLED = 0.9
"""Clamping probability of earlier drives' evidence, occupied or free, so that a later drive that disagrees
soon wins. Chosen by judgement: ten passes free a cell, three hits occupy one."""
_SURE = 20.0
"""Log odds at which a cell is 0 or 100 percent occupied, clipped so that the exponential stays finite."""


def log_odds(probability: float) -> np.float64:
    """Log odds of a probability between 0 and 1."""
    return np.float64(np.log(probability / (1.0 - probability)))


def occupancy(
    hits: NDArray[np.uint16], passes: NDArray[np.uint16], config: RenderingConfig
) -> NDArray[np.int8]:
    """Percent occupied, or unknown, of cells with these numbers of hits and passes."""
    odds = log_odds(config.hit_probability) * hits + log_odds(config.pass_probability) * passes
    percent = np.rint(100.0 / (1.0 + np.exp(-np.clip(odds, -_SURE, _SURE))))
    return np.where(hits + passes > 0, percent, UNKNOWN).astype(np.int8)


def looks_until_free(config: RenderingConfig) -> int:
    """Number of passes after which a cell is free."""
    return int(np.ceil(log_odds(FREE_THRESHOLD) / log_odds(config.pass_probability)))


def settle(hits: NDArray[np.uint16], passes: NDArray[np.uint16], config: RenderingConfig) -> None:
    """Clamp counts of any shape in place, to those of a certainty of at most `_SETTLED`."""
    per_hit, per_pass = log_odds(config.hit_probability), log_odds(config.pass_probability)
    bound = log_odds(_SETTLED)
    seen = np.nonzero(hits + passes)
    evidence = np.clip(per_hit * hits[seen] + per_pass * passes[seen], -bound, bound)
    hits[seen] = np.where(evidence > 0.0, np.maximum(np.rint(evidence / per_hit), 1.0), 0.0)
    passes[seen] = np.where(evidence > 0.0, 0.0, np.maximum(np.rint(evidence / per_pass), 1.0))
