"""Counting the bins that a cloud covers."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose

_EMPTY = -1
_MIX = np.uint64(0x9E3779B97F4A7C15)


@njit(cache=True, nogil=True)
def count_occupied(map_from_base: Pose, weights: NDArray[np.float64], bin_size: Pose, least: float) -> int:
    """How many bins (3,) of metres and radians hold a particle (N, 3) that weighs at least so much."""
    bits = 1
    while 1 << bits < 2 * len(weights):
        bits += 1
    table = np.full(1 << bits, _EMPTY, dtype=np.int64)
    occupied = 0
    for i in range(len(weights)):
        if weights[i] < least:
            continue
        key = np.int64(0)
        for axis in range(3):
            key = (key << 20) | (np.int64(math.floor(map_from_base[i, axis] / bin_size[axis])) & 0xFFFFF)
        slot = np.int64((np.uint64(key) * _MIX) >> np.uint64(64 - bits))
        while table[slot] != _EMPTY and table[slot] != key:
            slot = (slot + 1) & ((1 << bits) - 1)
        if table[slot] == _EMPTY:
            table[slot] = key
            occupied += 1
    return occupied
