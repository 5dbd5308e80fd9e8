"""The heaviest cluster of particles, and its mean and covariance."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.geometry.se2_kernels import wrapped

_SECTORS = 8
"""Parts of the turn by which headings are counted: eighths, so that a block of two is a quarter of the turn,
which parts a heading from those along a crossing corridor."""
_TURN = 2.0 * math.pi
"""Radians, by definition."""


@njit(cache=True, nogil=True)
def cluster_moments(
    map_from_base: Pose, weights: NDArray[np.float64], place_size: float, radius: float, half_angle: float
) -> tuple[Pose, NDArray[np.float64], float]:
    """Mean (3,), covariance (3, 3) and weight of the heaviest cluster of particles (N, 3).

    The heaviest of the squares of ``place_size`` metres is found, and its cluster is what lies within a
    ``radius`` of it (metres) and faces its way to a ``half_angle`` (radians).
    """
    first = map_from_base[0]
    mean, covariance, weight, is_whole = _moments_about(first, map_from_base, weights, radius, half_angle)
    if not is_whole:
        center = _heaviest_place(map_from_base, weights, place_size)
        mean, covariance, weight, _ = _moments_about(center, map_from_base, weights, radius, half_angle)
    return mean, covariance, min(weight, 1.0)


@njit(cache=True, nogil=True)
def _moments_about(
    center: Pose, map_from_base: Pose, weights: NDArray[np.float64], radius: float, half_angle: float
) -> tuple[Pose, NDArray[np.float64], float, bool]:
    """Of the particles near a pose (3,): mean, covariance and weight, and whether these are all there are."""
    count, total, x, y, turn, xx, xy, xt, yy, yt, tt = _sums_about(
        center, map_from_base, weights, radius, half_angle
    )
    x, y, turn = x / total, y / total, turn / total
    mean, covariance = np.empty(3), np.empty((3, 3))
    mean[0], mean[1], mean[2] = center[0] + x, center[1] + y, wrapped(center[2] + turn)
    covariance[0, 0] = xx / total - x * x
    covariance[1, 1] = yy / total - y * y
    covariance[2, 2] = tt / total - turn * turn
    covariance[0, 1] = covariance[1, 0] = xy / total - x * y
    covariance[0, 2] = covariance[2, 0] = xt / total - x * turn
    covariance[1, 2] = covariance[2, 1] = yt / total - y * turn
    return mean, covariance, total, count == len(weights)


@njit(cache=True, nogil=True, fastmath={"contract"})
def _sums_about(
    center: Pose, map_from_base: Pose, weights: NDArray[np.float64], radius: float, half_angle: float
) -> tuple[float, ...]:
    """Of the particles near a pose (3,): how many, weight, and weighed x, y, turn and their products.

    A loop of its own, without branches, so that the compiler keeps all sums in registers.
    """
    center_x, center_y, center_yaw = center[0], center[1], center[2]
    squared_radius = radius * radius
    count = 0
    total = 0.0
    x, y, turn = 0.0, 0.0, 0.0
    xx, xy, xt, yy, yt, tt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(len(weights)):
        dx, dy = map_from_base[i, 0] - center_x, map_from_base[i, 1] - center_y
        dt = wrapped(map_from_base[i, 2] - center_yaw)
        is_near = (dx * dx + dy * dy < squared_radius) & (abs(dt) < half_angle)
        weight = weights[i] if is_near else 0.0
        count += is_near
        total += weight
        x += weight * dx
        y += weight * dy
        turn += weight * dt
        xx += weight * dx * dx
        xy += weight * dx * dy
        xt += weight * dx * dt
        yy += weight * dy * dy
        yt += weight * dy * dt
        tt += weight * dt * dt
    return count, total, x, y, turn, xx, xy, xt, yy, yt, tt


@njit(cache=True, nogil=True)
def _heaviest_place(map_from_base: Pose, weights: NDArray[np.float64], place_size: float) -> Pose:
    """Mean (3,) of the particles at the heaviest place and sector."""
    low_x, low_y = np.inf, np.inf
    high_x, high_y = -np.inf, -np.inf
    for i in range(len(weights)):
        low_x, high_x = min(low_x, map_from_base[i, 0]), max(high_x, map_from_base[i, 0])
        low_y, high_y = min(low_y, map_from_base[i, 1]), max(high_y, map_from_base[i, 1])
    columns = int((high_x - low_x) / place_size) + 2
    rows = int((high_y - low_y) / place_size) + 2
    gathered = np.zeros((rows, columns, _SECTORS))
    for i in range(len(weights)):
        row, column, sector = _place_of(map_from_base[i], low_x, low_y, place_size)
        gathered[row, column, sector] += weights[i]
    heaviest, at_row, at_column, at_sector = -1.0, 0, 0, 0
    for row in range(rows - 1):
        for column in range(columns - 1):
            for sector in range(_SECTORS):
                weight = 0.0
                for k in range(8):  # a block of 2 x 2 x 2, so that it does not matter where places end
                    weight += gathered[row + (k & 1), column + (k >> 1 & 1), (sector + (k >> 2)) % _SECTORS]
                if weight > heaviest:
                    heaviest, at_row, at_column, at_sector = weight, row, column, sector
    center = np.zeros(3)
    sine, cosine = 0.0, 0.0
    for i in range(len(weights)):
        row, column, sector = _place_of(map_from_base[i], low_x, low_y, place_size)
        if 0 <= row - at_row <= 1 and 0 <= column - at_column <= 1 and (sector - at_sector) % _SECTORS <= 1:
            center[0] += weights[i] * map_from_base[i, 0]
            center[1] += weights[i] * map_from_base[i, 1]
            sine += weights[i] * math.sin(map_from_base[i, 2])
            cosine += weights[i] * math.cos(map_from_base[i, 2])
    center[0] /= heaviest
    center[1] /= heaviest
    center[2] = math.atan2(sine, cosine)
    return center


@njit(cache=True, nogil=True, inline="always")
def _place_of(map_from_base: Pose, low_x: float, low_y: float, place_size: float) -> tuple[int, int, int]:
    row = int((map_from_base[1] - low_y) / place_size)
    column = int((map_from_base[0] - low_x) / place_size)
    return row, column, int(_SECTORS * (map_from_base[2] / _TURN + 1.0)) % _SECTORS
