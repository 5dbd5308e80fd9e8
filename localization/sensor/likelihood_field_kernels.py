"""The loop over particles and beams of the likelihood field."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.localization.numerics.trigonometry_kernels import sin_cos
from racecar.maps.geometry.se2 import Pose


@njit(cache=True, nogil=True)
def add_up_ends(
    map_from_base: Pose,
    grid_in_map: NDArray[np.float64],
    cells_to_wall: NDArray[np.uint8],
    is_open: NDArray[np.bool_],
    ends_in_base: NDArray[np.float64],
    log_probabilities: NDArray[np.float32],
) -> NDArray[np.float64]:
    """(N,) sum over ends (B, 2) of the log-probability of their distance to a wall, for particles (N, 3).

    ``grid_in_map`` is x, y, cos and sin of the grid's origin and cells per metre. An end beyond the grid
    gets the last log-probability, a particle where the car cannot be that for all its ends.
    """
    x0, y0, cos0, sin0, per_metre = grid_in_map
    rows, columns = cells_to_wall.shape
    beyond = log_probabilities[-1]
    totals = np.empty(len(map_from_base))
    for i in range(len(map_from_base)):
        sine, cosine = sin_cos(map_from_base[i, 2])
        cos, sin = cosine * cos0 + sine * sin0, sine * cos0 - cosine * sin0
        x, y = map_from_base[i, 0] - x0, map_from_base[i, 1] - y0
        column0, row0 = (cos0 * x + sin0 * y) * per_metre, (cos0 * y - sin0 * x) * per_metre
        totals[i] = beyond * len(ends_in_base)
        if not (0 <= row0 < rows and 0 <= column0 < columns) or not is_open[int(row0), int(column0)]:
            continue
        cos *= per_metre
        sin *= per_metre
        total = np.float32(0.0)
        for beam in range(len(ends_in_base)):
            column = column0 + cos * ends_in_base[beam, 0] - sin * ends_in_base[beam, 1]
            row = row0 + sin * ends_in_base[beam, 0] + cos * ends_in_base[beam, 1]
            if 0 <= row < rows and 0 <= column < columns:
                total += log_probabilities[cells_to_wall[int(row), int(column)]]
            else:
                total += beyond
        totals[i] = total
    return totals
