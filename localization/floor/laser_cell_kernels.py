"""Where on the grid a laser is."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True, inline="always")
def laser_cell(
    x: float, y: float, cos: float, sin: float, laser: NDArray[np.float64], grid_in_map: NDArray[np.float64]
) -> tuple[float, float]:
    """Row and column, fractions and all, of a laser on a base at x, y that faces along (cos, sin) in the map.

    ``laser`` is its x and y on the base; ``grid_in_map`` is x, y, cos and sin of the grid's
    origin and cells per metre.
    """
    x0, y0, cos0, sin0, per_metre = grid_in_map
    right, up = x + cos * laser[0] - sin * laser[1] - x0, y + sin * laser[0] + cos * laser[1] - y0
    return (cos0 * up - sin0 * right) * per_metre, (cos0 * right + sin0 * up) * per_metre
