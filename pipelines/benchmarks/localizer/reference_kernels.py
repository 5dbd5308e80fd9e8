"""The loops that the localizer is measured against."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose


@njit(cache=True, nogil=True)
def add_up_loads(
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    ranges: NDArray[np.uint8],
    sensor_table: NDArray[np.int32],
) -> int:
    """The loads of a sensor update and nothing else: rows (N,) and columns (B,) are known beforehand.

    Each byte of ``ranges`` picks a number from the beam's row of ``sensor_table`` (B, 256). It has whole
    numbers, as wide as the real ones, because those cannot be added without waiting for the sum before.
    """
    total = 0
    for i in range(len(rows)):
        for beam in range(len(columns)):
            total += sensor_table[beam, ranges[rows[i], columns[beam]]]
    return total


@njit(cache=True, nogil=True)
def add_up_scattered_loads(
    addresses: NDArray[np.uint32], ranges: NDArray[np.uint8], sensor_table: NDArray[np.int32]
) -> int:
    """The same from addresses (N, B) into ``ranges``, laid out flat: no two loads need be near each other."""
    total = 0
    for i in range(addresses.shape[0]):
        for beam in range(addresses.shape[1]):
            total += sensor_table[beam, ranges[addresses[i, beam]]]
    return total


@njit(cache=True, nogil=True)
def march_rays(
    distances: NDArray[np.float32], starts: Pose, bearings: NDArray[np.float64], reach: float
) -> NDArray[np.float64]:
    """(N, B) cells to the nearest wall, at most ``reach``, from starts (N, 3) of column, row and heading.

    ``distances`` (rows, columns) are cells to the nearest wall: as far, a ray can safely leap.
    """
    rows, columns = distances.shape
    ranges = np.empty((len(starts), len(bearings)))
    for i in range(len(starts)):
        for beam in range(len(bearings)):
            heading = starts[i, 2] + bearings[beam]
            cos, sin = math.cos(heading), math.sin(heading)
            gone = 0.0
            while gone < reach:
                column = math.floor(starts[i, 0] + gone * cos)
                row = math.floor(starts[i, 1] + gone * sin)
                if not (0 <= row < rows and 0 <= column < columns):
                    gone = reach
                    break
                leap = distances[row, column]
                if leap <= 0.0:
                    break
                gone += max(leap - 1.0, 1.0)  # a cell less, as both ends are somewhere within their cells
            ranges[i, beam] = min(gone, reach)
    return ranges


@njit(cache=True, nogil=True)
def spin(turns: int) -> int:
    """Work that needs neither memory nor the interpreter; its result means nothing."""
    state = np.uint64(1)
    for _ in range(turns):
        state ^= state << np.uint64(13)
        state ^= state >> np.uint64(7)
        state ^= state << np.uint64(17)
    return int(state & np.uint64(1))
