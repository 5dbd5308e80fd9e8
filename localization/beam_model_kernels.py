"""The loops over particles and beams of the beam model."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from localization.trigonometry_kernels import sin_cos
from maps.ray_casting_kernels import cast_one
from maps.se2 import Pose

_PER_RADIAN = 2.0**32 / (2.0 * math.pi)
_BATCH = 64
"""Particles whose rows of the table are fetched before any is read: many trips to memory at once."""
_CACHE_LINE = 64


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
    """(N,) sum over beams of the log-probability (beam, code of the expected range) for particles (N, 3).

    ``laser_on_base`` is x, y; ``grid_in_map`` x, y, cos and sin of the grid's origin and cells per metre;
    ``bearings`` (B,) are relative to the base's yaw less the grid's, with 2^32 to the turn. A particle off
    the table gets ``outside``. One particle after the other: its beams lie in one row of the table.
    """
    headings = np.uint64(ranges.shape[1])
    half = np.uint32(2**31 // ranges.shape[1])
    totals = np.empty(len(map_from_base))
    sine, cosine = np.empty(_BATCH), np.empty(_BATCH)
    place = np.empty(_BATCH, dtype=np.int64)
    fetched = 0
    for start in range(0, len(map_from_base), _BATCH):
        batch = map_from_base[start : start + _BATCH]
        for i in range(len(batch)):
            sine[i], cosine[i] = sin_cos(batch[i, 2])
        for i in range(len(batch)):
            place[i] = _cell_of(batch[i], sine[i], cosine[i], laser_on_base, grid_in_map, cell_index)
            if place[i] >= 0:
                row = ranges[place[i]]
                for byte in range(0, len(row), _CACHE_LINE):
                    fetched += row[byte]
        for i in range(len(batch)):
            if place[i] < 0:
                totals[start + i] = outside
                continue
            expected = ranges[place[i]]
            heading = np.uint32(np.int64(batch[i, 2] * _PER_RADIAN) & 0xFFFFFFFF) + half
            total = np.float32(0.0)
            for beam in range(len(bearings)):
                direction = np.uint64(np.uint32(heading + bearings[beam]))
                total += log_probabilities[beam, expected[direction * headings >> np.uint64(32)]]
            totals[start + i] = total
    if fetched < 0:  # never, but the compiler does not know, and so does not leave the fetching out
        totals[0] = 0.0
    return totals


@njit(cache=True, nogil=True)
def add_up_cast_beams(
    map_from_base: Pose,
    laser_on_base: NDArray[np.float64],
    grid_in_map: NDArray[np.float64],
    is_open: NDArray[np.bool_],
    cells: NDArray[np.int8],
    bearings: NDArray[np.float64],
    log_probabilities: NDArray[np.float32],
    code_of_cells: NDArray[np.uint8],
    outside: float,
) -> NDArray[np.float64]:
    """(N,) the same from rays through the grid; ``bearings`` (B,) are radians."""
    x0, y0, cos0, sin0, per_metre = grid_in_map
    farthest = len(code_of_cells) - 1
    totals = np.empty(len(map_from_base))
    for i in range(len(map_from_base)):
        yaw = map_from_base[i, 2]
        cos, sin = math.cos(yaw), math.sin(yaw)
        x = map_from_base[i, 0] + cos * laser_on_base[0] - sin * laser_on_base[1] - x0
        y = map_from_base[i, 1] + sin * laser_on_base[0] + cos * laser_on_base[1] - y0
        column, row = (cos0 * x + sin0 * y) * per_metre, (cos0 * y - sin0 * x) * per_metre
        totals[i] = outside
        if not (0 <= row < is_open.shape[0] and 0 <= column < is_open.shape[1]):
            continue
        if not is_open[int(row), int(column)]:
            continue
        total = np.float32(0.0)
        for beam in range(len(bearings)):
            direction = yaw + bearings[beam]
            reach = cast_one(cells, row, column, math.sin(direction), math.cos(direction), farthest)
            code = code_of_cells[int(min(reach, farthest) + 0.5)]
            total += log_probabilities[beam, code]
        totals[i] = total
    return totals


@njit(cache=True, nogil=True)
def _cell_of(
    map_from_base: Pose,
    sine: float,
    cosine: float,
    laser_on_base: NDArray[np.float64],
    grid_in_map: NDArray[np.float64],
    cell_index: NDArray[np.int32],
) -> int:
    """The table's row for the laser of a pose (3,); negative off the table."""
    x0, y0, cos0, sin0, per_metre = grid_in_map
    x = map_from_base[0] + cosine * laser_on_base[0] - sine * laser_on_base[1] - x0
    y = map_from_base[1] + sine * laser_on_base[0] + cosine * laser_on_base[1] - y0
    column = math.floor((cos0 * x + sin0 * y) * per_metre)
    row = math.floor((cos0 * y - sin0 * x) * per_metre)
    if not (0 <= row < cell_index.shape[0] and 0 <= column < cell_index.shape[1]):
        return -1
    return int(cell_index[row, column])
