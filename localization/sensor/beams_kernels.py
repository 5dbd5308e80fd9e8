"""Setting the beams of a moving laser back to one moment."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.geometry.se2_kernels import wrapped

_KNOTS = 8
"""Moments of a sweep at which the car's pose is computed, since a car moves evenly for the 4 ms between two
of them (a sweep takes 25 to 200 ms, and odometry comes every 20 ms)."""
_SHORTEST_SWEEP = 1e-6
"""Seconds, so that no two knots are the same."""


@njit(cache=True, nogil=True)
def useful_beams(bearings: NDArray[np.float64], ranges: NDArray[np.float64]) -> NDArray[np.int64]:
    """(U,) numbers of the beams (N,) that carry information: returns and misses, not nan."""
    useful = np.empty(len(ranges), dtype=np.int64)
    count = 0
    for beam in range(len(ranges)):
        useful[count] = beam
        count += ranges[beam] >= 0.0 and math.isfinite(bearings[beam])
    return useful[:count]


@njit(cache=True, nogil=True)
def knots_of_sweep(
    offsets: NDArray[np.float64], longest: float, stamp: int
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """(K,) seconds from a scan's stamp, even over its beams' offsets (B,), between which a car moves evenly.

    And (K + 1,) nanoseconds: their stamps, and the scan's. None where no beam has an offset, or one has that
    is too long or no number.
    """
    first, last = 0.0, 0.0
    for offset in offsets:
        if not -longest < offset < longest:
            return np.empty(0), np.empty(0, dtype=np.int64)
        first, last = min(first, offset), max(last, offset)
    if first == last:
        return np.empty(0), np.empty(0, dtype=np.int64)
    knots, stamps = np.empty(_KNOTS), np.full(_KNOTS + 1, stamp)
    for knot in range(_KNOTS):
        knots[knot] = first + max(last - first, _SHORTEST_SWEEP) * knot / (_KNOTS - 1)
        stamps[knot] += int(np.rint(1e9 * knots[knot]))
    return knots, stamps


@njit(cache=True, nogil=True)
def set_back(
    bearings: NDArray[np.float64],
    ranges: NDArray[np.float64],
    offsets: NDArray[np.float64],
    knots: NDArray[np.float64],
    odom_from_base: Pose,
    base_from_laser: Pose,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Bearings and ranges (B,) of the same end points from where the laser is at the stamp.

    The base's poses (K + 1, 3) are at ascending ``knots`` (K,), seconds from the stamp like the beams'
    offsets (B,), and straight between; the last is at the stamp. Beams that met nothing are only turned.
    """
    new_bearings, new_ranges = np.empty_like(bearings), np.empty_like(ranges)
    x0, y0, yaw0 = _laser_of(odom_from_base[-1], base_from_laser)
    cos0, sin0 = math.cos(yaw0), math.sin(yaw0)
    laser = np.empty((len(knots), 3))
    for knot in range(len(knots)):
        laser[knot, 0], laser[knot, 1], laser[knot, 2] = _laser_of(odom_from_base[knot], base_from_laser)
    for beam in range(len(bearings)):
        right = min(max(np.searchsorted(knots, offsets[beam]), 1), len(knots) - 1)
        left = right - 1
        share = (offsets[beam] - knots[left]) / (knots[right] - knots[left])
        x = laser[left, 0] + share * (laser[right, 0] - laser[left, 0]) - x0
        y = laser[left, 1] + share * (laser[right, 1] - laser[left, 1]) - y0
        turn = laser[left, 2] + share * wrapped(laser[right, 2] - laser[left, 2]) - yaw0
        direction = wrapped(bearings[beam] + turn)
        new_bearings[beam], new_ranges[beam] = direction, ranges[beam]
        if math.isfinite(ranges[beam]):
            end_x = cos0 * x + sin0 * y + ranges[beam] * math.cos(direction)
            end_y = cos0 * y - sin0 * x + ranges[beam] * math.sin(direction)
            new_bearings[beam] = math.atan2(end_y, end_x)
            new_ranges[beam] = math.hypot(end_x, end_y)
    return new_bearings, new_ranges


@njit(cache=True, nogil=True)
def points_of(
    bearings: NDArray[np.float64], ranges: NDArray[np.float64], base_from_laser: Pose
) -> NDArray[np.float64]:
    """(N, 2) where the beams (B,) that met something end, in the base frame."""
    points = np.empty((len(bearings), 2))
    count = 0
    for beam in range(len(bearings)):
        if math.isfinite(ranges[beam]):
            direction = base_from_laser[2] + bearings[beam]
            points[count, 0] = base_from_laser[0] + ranges[beam] * math.cos(direction)
            points[count, 1] = base_from_laser[1] + ranges[beam] * math.sin(direction)
            count += 1
    return points[:count]


@njit(cache=True, nogil=True)
def _laser_of(odom_from_base: Pose, base_from_laser: Pose) -> tuple[float, float, float]:
    cos, sin = math.cos(odom_from_base[2]), math.sin(odom_from_base[2])
    return (
        odom_from_base[0] + cos * base_from_laser[0] - sin * base_from_laser[1],
        odom_from_base[1] + sin * base_from_laser[0] + cos * base_from_laser[1],
        odom_from_base[2] + base_from_laser[2],
    )
