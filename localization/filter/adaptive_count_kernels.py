"""How many particles a cloud needs: the more places it covers, the more.

Dieter Fox: Adapting the Sample Size in Particle Filters Through KLD-Sampling, Int. J. of Robotics Research
22 (2003). With so many particles the Kullback-Leibler distance between them and the cloud that they stand
for stays below a bound, with high probability.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.localization.filter.config import AdaptiveCountConfig
from racecar.maps.geometry.se2 import Pose

_NORMAL_QUANTILE = 2.326
"""Of 99 %, the probability that the bound is kept, by definition of the normal distribution."""
_EMPTY = -1
"""Slot of the hash table without a bin: no key, since keys are bits of three numbers and never negative."""
_MIX = np.uint64(0x9E3779B97F4A7C15)
"""Odd number next to 2^64 over the golden ratio (Knuth: The Art of Computer Programming 3, 1973, 6.4), so
that neighbouring keys fall into slots far apart."""


def needed_particles(
    map_from_base: Pose, weights: NDArray[np.float64], fewest: int, most: int, config: AdaptiveCountConfig
) -> int:
    """The count for particles (N, 3) of weights (N,) that sum to 1, between ``fewest`` and ``most``."""
    if fewest >= most:
        return most
    bins = np.array([config.bin_size, config.bin_size, config.bin_angle])
    occupied = count_occupied(map_from_base, weights, bins, config.least_share / len(weights))
    if occupied <= 1:
        return fewest
    tail = 2.0 / (9.0 * (occupied - 1))
    bound = (occupied - 1) / (2.0 * config.distance) * (1.0 - tail + np.sqrt(tail) * _NORMAL_QUANTILE) ** 3
    return int(np.clip(np.ceil(bound), fewest, most))


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
