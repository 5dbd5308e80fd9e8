"""A part of a map that a car is in."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Region:
    """A circle."""

    center: NDArray[np.float64]
    """(2,) in the map."""
    radius: float
    """Metres."""

    def contains(self, points_in_map: NDArray[np.float64], reach: float = 0.0) -> NDArray[np.bool_]:
        """(N,) whether points (N, 2) lie in it, or no more than ``reach`` metres beside it."""
        off = points_in_map - self.center
        return np.asarray(np.hypot(off[:, 0], off[:, 1]) <= self.radius + reach, dtype=np.bool_)


ANYWHERE = Region(np.zeros(2), np.inf)
"""The whole plane, by definition of an infinite radius."""
