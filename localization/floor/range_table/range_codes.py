"""Ranges in one byte: in steps of 5 cm near by, and farther off in steps that grow with the range.

They are metres, whatever the resolution of the map: what a reading says does not depend on how finely the
walls were drawn.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

RANGE_STEP = 0.05
"""Metres in which ranges are counted, since a laser of a small car errs by 1 to 3 cm and the sensor model's
widths are decimetres: 5 cm are the finest that change a likelihood by more than a few per cent."""
_EXACT = 100
"""Steps up to which each has a code of its own, 5 m, because the walls near by place the car; the codes that
are left reach 32 m without one that is off by three steps."""
_CODES = 256
"""Values of a byte, by definition."""
_LAST_TO_MEAN_STEP = 5.5 * (_CODES - 1 - _EXACT) / (640 - _EXACT)
"""Of the steps between the codes beyond, since they grow evenly: with a longest range of 32 m (640 steps) the
last two codes are 5.5 steps apart, so that no range is off by three."""


@dataclass(frozen=True, eq=False)
class RangeCodes:
    """What the 256 codes mean, up to a longest range."""

    steps: NDArray[np.float64]
    """(256,) the range in steps of 5 cm that each code stands for, ascending."""
    code_of_steps: NDArray[np.uint8]
    """(S + 1,) the nearest code of each whole number of steps; longer ranges have the last."""
    codes_per_step: NDArray[np.float64]
    """(S + 1,) how many codes more a range of one step more is, at each whole number of steps."""

    @property
    def longest_steps(self) -> int:
        """S: where ranges are clipped, in steps."""
        return len(self.code_of_steps) - 1

    @property
    def longest_range(self) -> float:
        """The same in metres."""
        return self.longest_steps * RANGE_STEP

    def encode(self, ranges: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Codes of ranges in metres, of any shape; inf is the longest."""
        return self.code_of_steps[
            np.minimum(np.rint(ranges / RANGE_STEP), self.longest_steps).astype(np.int64)
        ]

    def decode(self, codes: NDArray[np.uint8]) -> NDArray[np.float64]:
        """Metres that codes stand for, of any shape."""
        return self.steps[codes] * RANGE_STEP


@lru_cache(maxsize=4)
def range_codes(longest_range: float) -> RangeCodes:
    """The codes that reach a longest range in metres, over 5 m."""
    longest = round(longest_range / RANGE_STEP)
    count = _CODES - 1 - _EXACT
    beyond = np.arange(1.0, count + 1.0)
    mean_step = (longest - _EXACT) / count
    growth = (_LAST_TO_MEAN_STEP - 1.0) * mean_step / (count - 1)
    steps = np.concatenate(
        [np.arange(_EXACT + 1), _EXACT + (mean_step - growth * count) * beyond + growth * beyond**2]
    )
    nearest = np.searchsorted(0.5 * (steps[1:] + steps[:-1]), np.arange(longest + 1.0))
    code_of_steps = nearest.astype(np.uint8)
    return RangeCodes(steps, code_of_steps, (1.0 / np.gradient(steps))[code_of_steps])
