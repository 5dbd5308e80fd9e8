"""Ranges in one byte: to the cell near by, and farther off in steps that grow with the range."""

import numpy as np
from numpy.typing import NDArray

_EXACT = 100
"""Cells up to which each has a code of its own: 5 m on a map of 5 cm."""
FARTHEST = 640
"""Cells; longer ranges are clipped here, 32 m on a map of 5 cm."""
_LAST_STEP = 5.5
"""Cells between the last two codes, so that none is off by three."""

_CODES = 256


def _decoded() -> NDArray[np.float64]:
    count = _CODES - 1 - _EXACT
    beyond = np.arange(1.0, count + 1.0)
    mean_step = (FARTHEST - _EXACT) / count
    growth = (_LAST_STEP - mean_step) / (count - 1)
    return np.concatenate(
        [np.arange(_EXACT + 1), _EXACT + (mean_step - growth * count) * beyond + growth * beyond**2]
    )


CELLS_OF_CODE: NDArray[np.float64] = _decoded()
"""(256,) the range in cells that each code stands for, ascending."""
CODE_OF_CELLS: NDArray[np.uint8] = np.searchsorted(
    0.5 * (CELLS_OF_CODE[1:] + CELLS_OF_CODE[:-1]), np.arange(FARTHEST + 1.0)
).astype(np.uint8)
"""(FARTHEST + 1,) the nearest code of each whole number of cells."""
