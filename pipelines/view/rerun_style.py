"""The colours and heights of what is drawn with rerun, in recordings and live."""

import numpy as np
from numpy.typing import NDArray

PATH, LOOP, SCAN, PARTICLE, CAR, SKY = (
    *([0, 114, 178], [213, 94, 0], [230, 159, 0], [204, 121, 167], [0, 158, 115], [86, 180, 233]),
)
"""Red, green and blue of Okabe and Ito's palette (2008), since it is told apart by colour-blind eyes, too."""
CAR_LENGTH = 0.5
"""Metres of the arrow for the car, since that is about as long as a car at a tenth of full size."""


def raised(places: NDArray[np.float64] | NDArray[np.float32], height: float) -> NDArray[np.float32]:
    """(N, 3) places (N, 2) at a height (metres) above the map, so that nothing lower hides them."""
    return np.column_stack([places, np.full(len(places), height)]).astype(np.float32)
