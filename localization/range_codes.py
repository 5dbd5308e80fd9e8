"""Ranges in one byte: to the cell near by, to a hundredth and a half of the way far off."""

import numpy as np
from numpy.typing import NDArray

_EXACT = 160
"""Cells up to which each has a code of its own: 8 m on a map of 5 cm."""
FARTHEST = 720
"""Cells; longer ranges are clipped here, 36 m on a map of 5 cm."""

_CODES = 256


def _decoded() -> NDArray[np.float64]:
    beyond = _CODES - 1 - _EXACT
    growth = (FARTHEST / _EXACT) ** (np.arange(1, beyond + 1) / beyond)
    return np.concatenate([np.arange(_EXACT + 1), _EXACT * growth])


CELLS_OF_CODE: NDArray[np.float64] = _decoded()
"""(256,) the range in cells that each code stands for, ascending."""
CODE_OF_CELLS: NDArray[np.uint8] = np.searchsorted(
    0.5 * (CELLS_OF_CODE[1:] + CELLS_OF_CODE[:-1]), np.arange(FARTHEST + 1.0)
).astype(np.uint8)
"""(FARTHEST + 1,) the nearest code of each whole number of cells."""
