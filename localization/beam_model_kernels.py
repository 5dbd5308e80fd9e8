"""The loops over particles and beams of the beam model."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from localization.trigonometry_kernels import BATCH, take_batch
from maps.ray_casting_kernels import cast_one
from maps.se2 import Pose

_PER_RADIAN = 2.0**16 / (2.0 * math.pi)
_CACHE_BYTES = 4_000_000
"""Particles whose rows of the table together take more are spread too widely for the processor's cache."""
_FETCHED = 64
"""Of these, so many rows are fetched before any is read: many trips to memory at once."""
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
) -> NDArray[np.float64]:
    """(N,) sum over beams of the log-probability (beam, code of the expected range) for particles (N, 3).

    ``laser_on_base`` is x, y; ``grid_in_map`` x, y, cos and sin of the grid's origin and cells per metre;
    ``bearings`` (B,) are relative to the base's yaw less the grid's, with 2^16 to the turn. A particle off
    the table gets what the least likely codes give. One particle after the other: the beams of one lie in one
    row of the table.
    """
    rows, headings = _locate(map_from_base, laser_on_base, grid_in_map, cell_index)
    is_large = len(rows) * ranges.shape[1] > _CACHE_BYTES
    per_turn = np.uint32(ranges.shape[1])
    half = np.uint32(2**15 // ranges.shape[1])
    columns = np.empty(len(bearings), dtype=np.uint32)
    totals = np.empty(len(rows))
    fetched = 0
    outside = 1.0  # summed up when a particle needs it
    for start in range(0, len(rows), _FETCHED):
        end = min(start + _FETCHED, len(rows))
        if is_large:
            fetched += _fetch(rows[start:end], ranges)
        for i in range(start, end):
            if rows[i] < 0:
                if outside > 0.0:
                    outside = _least_of(log_probabilities)
                totals[i] = outside
                continue
            expected = ranges[rows[i]]
            heading = headings[i] + half
            for beam in range(len(bearings)):
                columns[beam] = _column_of(heading, bearings[beam], per_turn)
            total = np.float32(0.0)
            for beam in range(len(bearings)):
                total += log_probabilities[beam, expected[columns[beam]]]
            totals[i] = total
    if fetched < 0:  # never, but the compiler does not know, and so does not leave the fetching out
        totals[0] = 0.0
    return totals


@njit(cache=True, nogil=True)
def find_fitting(
    map_from_base: Pose,
    laser_on_base: NDArray[np.float64],
    grid_in_map: NDArray[np.float64],
    cell_index: NDArray[np.int32],
    ranges: NDArray[np.uint8],
    bearings: NDArray[np.uint32],
    first_codes: NDArray[np.int64],
    end_codes: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """(N, B) whether the code expected by particles (N, 3) is from each beam's first to before its end.

    The rest is as for `add_up_beams`; off the table, nothing fits.
    """
    rows, headings = _locate(map_from_base, laser_on_base, grid_in_map, cell_index)
    per_turn = np.uint32(ranges.shape[1])
    half = np.uint32(2**15 // ranges.shape[1])
    fits = np.zeros((len(rows), len(bearings)), dtype=np.bool_)
    for i in range(len(rows)):
        if rows[i] < 0:
            continue
        for beam in range(len(bearings)):
            code = ranges[rows[i], _column_of(headings[i] + half, bearings[beam], per_turn)]
            fits[i, beam] = first_codes[beam] <= code < end_codes[beam]
    return fits


@njit(cache=True, nogil=True)
def _locate(
    map_from_base: Pose,
    laser_on_base: NDArray[np.float64],
    grid_in_map: NDArray[np.float64],
    cell_index: NDArray[np.int32],
) -> tuple[NDArray[np.int64], NDArray[np.uint32]]:
    """Rows of the table (N,), negative off it, and headings (N,) with 2^16 to the turn, of the lasers."""
    x0, y0, cos0, sin0, per_metre = grid_in_map
    ahead, left = laser_on_base
    rows = np.empty(len(map_from_base), dtype=np.int64)
    headings = np.empty(len(map_from_base), dtype=np.uint32)
    yaw, sine, cosine = np.empty(BATCH), np.empty(BATCH), np.empty(BATCH)
    for start in range(0, len(map_from_base), BATCH):
        count = take_batch(map_from_base, start, yaw, sine, cosine)
        for k in range(count):
            x = map_from_base[start + k, 0] + cosine[k] * ahead - sine[k] * left - x0
            y = map_from_base[start + k, 1] + sine[k] * ahead + cosine[k] * left - y0
            column = math.floor((cos0 * x + sin0 * y) * per_metre)
            row = math.floor((cos0 * y - sin0 * x) * per_metre)
            is_inside = 0 <= row < cell_index.shape[0] and 0 <= column < cell_index.shape[1]
            rows[start + k] = cell_index[row, column] if is_inside else -1
            headings[start + k] = np.uint32(np.int64(math.floor(yaw[k] * _PER_RADIAN)) & 0xFFFF)
    return rows, headings


@njit(cache=True, nogil=True, inline="always")
def _column_of(heading: np.uint32, bearing: np.uint32, per_turn: np.uint32) -> np.uint32:
    """The table's column for a beam; heading and bearing have 2^16 to the turn, columns ``per_turn``."""
    turned = np.uint32(np.uint32(heading + bearing) & np.uint32(0xFFFF))
    return np.uint32(turned * per_turn) >> np.uint32(16)


@njit(cache=True, nogil=True)
def _least_of(log_probabilities: NDArray[np.float32]) -> float:
    """The sum over beams of the least of each row."""
    total = 0.0
    for beam in range(len(log_probabilities)):
        least = log_probabilities[beam, 0]
        for code in range(log_probabilities.shape[1]):
            least = min(least, log_probabilities[beam, code])
        total += least
    return total


@njit(cache=True, nogil=True)
def _fetch(rows: NDArray[np.int64], ranges: NDArray[np.uint8]) -> int:
    """Touch every cache line of some rows of the table."""
    total = 0
    for row in rows:
        if row >= 0:
            for byte in range(0, ranges.shape[1], _CACHE_LINE):
                total += ranges[row, byte]
    return total


@njit(cache=True, nogil=True)
def add_up_cast_beams(
    map_from_base: Pose,
    laser_on_base: NDArray[np.float64],
    grid_in_map: NDArray[np.float64],
    is_standable: NDArray[np.bool_],
    cells: NDArray[np.int8],
    is_movable: NDArray[np.bool_],
    cells_without_movable: NDArray[np.int8],
    bearings: NDArray[np.float64],
    log_probabilities: NDArray[np.float32],
    code_of_cells: NDArray[np.uint8],
) -> NDArray[np.float64]:
    """(N,) the same from rays through the grid; ``bearings`` (B,) are radians."""
    x0, y0, cos0, sin0, per_metre = grid_in_map
    farthest = len(code_of_cells) - 1
    outside = _least_of(log_probabilities)
    totals = np.empty(len(map_from_base))
    for i in range(len(map_from_base)):
        yaw = map_from_base[i, 2]
        cos, sin = math.cos(yaw), math.sin(yaw)
        x = map_from_base[i, 0] + cos * laser_on_base[0] - sin * laser_on_base[1] - x0
        y = map_from_base[i, 1] + sin * laser_on_base[0] + cos * laser_on_base[1] - y0
        column, row = (cos0 * x + sin0 * y) * per_metre, (cos0 * y - sin0 * x) * per_metre
        totals[i] = outside
        if not (0 <= row < cells.shape[0] and 0 <= column < cells.shape[1]):
            continue
        if not is_standable[int(row), int(column)]:
            continue
        seen = cells_without_movable if is_movable[int(row), int(column)] else cells
        total = np.float32(0.0)
        for beam in range(len(bearings)):
            direction = yaw + bearings[beam]
            reach = cast_one(seen, row, column, math.sin(direction), math.cos(direction), farthest)
            code = code_of_cells[int(min(reach, farthest) + 0.5)]
            total += log_probabilities[beam, code]
        totals[i] = total
    return totals
