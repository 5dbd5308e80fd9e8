"""One revolution of a multi-row LiDAR."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Cloud:
    """N points in the levelled laser frame: x and y as in the plane, z the height above the base."""

    points: NDArray[np.float32]
    """(N, 3) metres."""
    time_offsets: NDArray[np.float32]
    """(N,) seconds from the scan's stamp to each point; all zero when the sensor does not report them."""
