"""The loop over particles and beams of the sensor model."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from maps.se2 import Pose

_PER_RADIAN = 2.0**32 / (2.0 * math.pi)


@njit(cache=True, nogil=True)
def add_up_beams(
    map_from_base: Pose,
    laser_on_base: NDArray[np.float64],
    grid_in_map: NDArray[np.float64],
    cell_index: NDArray[np.int32],
    ranges: NDArray[np.uint8],
    bearings: NDArray[np.uint32],
    log_probabilities: NDArray[np.float32],
    outside: float,
) -> NDArray[np.float64]:
    """(N,) sum over beams of the log-probability (beam, expected range) for particles (N, 3).

    ``laser_on_base`` is x, y; ``grid_in_map`` x, y, cos and sin of the grid's origin and cells per metre;
    ``bearings`` (B,) are relative to the base's yaw less the grid's, with 2^32 to the turn. A particle off
    the table gets ``outside``. One particle after the other: its beams lie in one row of the table.
    """
    rows, columns = cell_index.shape
    headings = np.uint64(ranges.shape[1])
    half = np.uint32(2**31 // ranges.shape[1])
    x0, y0, cos0, sin0, per_metre = grid_in_map
    totals = np.empty(len(map_from_base))
    for i in range(len(map_from_base)):
        yaw = map_from_base[i, 2]
        cos, sin = math.cos(yaw), math.sin(yaw)
        x = map_from_base[i, 0] + cos * laser_on_base[0] - sin * laser_on_base[1] - x0
        y = map_from_base[i, 1] + sin * laser_on_base[0] + cos * laser_on_base[1] - y0
        column = math.floor((cos0 * x + sin0 * y) * per_metre)
        row = math.floor((cos0 * y - sin0 * x) * per_metre)
        totals[i] = outside
        if not (0 <= row < rows and 0 <= column < columns) or cell_index[row, column] < 0:
            continue
        expected = ranges[cell_index[row, column]]
        heading = np.uint32(np.int64(yaw * _PER_RADIAN) & 0xFFFFFFFF) + half
        total = np.float32(0.0)
        for beam in range(len(bearings)):
            direction = np.uint64(np.uint32(heading + bearings[beam]))
            total += log_probabilities[beam, expected[direction * headings >> np.uint64(32)]]
        totals[i] = total
    return totals
