"""The heaviest cluster of particles, and its mean and covariance."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from localization.trigonometry_kernels import sin_cos, wrapped
from maps.se2 import Pose

_PLACE_SIZE = 0.5
_SECTORS = 8
"""Particles are counted by place, in metres, and by heading, in parts of the turn."""
_RADIUS, _HALF_ANGLE = 1.0, 1.0
"""Metres and radians about the heaviest place within which particles belong to its cluster."""
_TURN = 2.0 * math.pi


@njit(cache=True, nogil=True)
def cluster_moments(
    map_from_base: Pose, weights: NDArray[np.float64]
) -> tuple[Pose, NDArray[np.float64], float]:
    """Mean (3,), covariance (3, 3) and weight of the heaviest cluster of particles (N, 3)."""
    center, is_whole = _heaviest_place(map_from_base, weights)
    total, x, y, sine, cosine = 0.0, 0.0, 0.0, 0.0, 0.0
    is_near = np.empty(len(weights), dtype=np.bool_)
    for i in range(len(weights)):
        is_near[i] = is_whole or _is_near(map_from_base[i], center)
        if is_near[i]:
            s, c = sin_cos(map_from_base[i, 2])
            total += weights[i]
            x += weights[i] * map_from_base[i, 0]
            y += weights[i] * map_from_base[i, 1]
            sine += weights[i] * s
            cosine += weights[i] * c
    mean = np.array([x / total, y / total, math.atan2(sine, cosine)])
    covariance = np.zeros((3, 3))
    for i in range(len(weights)):
        if is_near[i]:
            dx, dy = map_from_base[i, 0] - mean[0], map_from_base[i, 1] - mean[1]
            turn = wrapped(map_from_base[i, 2] - mean[2])
            share = weights[i] / total
            covariance[0, 0] += share * dx * dx
            covariance[0, 1] += share * dx * dy
            covariance[0, 2] += share * dx * turn
            covariance[1, 1] += share * dy * dy
            covariance[1, 2] += share * dy * turn
            covariance[2, 2] += share * turn * turn
    covariance[1, 0], covariance[2, 0], covariance[2, 1] = (
        covariance[0, 1],
        covariance[0, 2],
        covariance[1, 2],
    )
    return mean, covariance, min(total, 1.0)


@njit(cache=True, nogil=True)
def _heaviest_place(map_from_base: Pose, weights: NDArray[np.float64]) -> tuple[Pose, bool]:
    """Mean (3,) of the particles at the heaviest place and sector, and whether all lie close together."""
    low_x, low_y = np.inf, np.inf
    high_x, high_y = -np.inf, -np.inf
    widest = 0.0
    for i in range(len(weights)):
        low_x, high_x = min(low_x, map_from_base[i, 0]), max(high_x, map_from_base[i, 0])
        low_y, high_y = min(low_y, map_from_base[i, 1]), max(high_y, map_from_base[i, 1])
        widest = max(widest, abs(wrapped(map_from_base[i, 2] - map_from_base[0, 2])))
    if high_x - low_x < _RADIUS and high_y - low_y < _RADIUS and widest < _HALF_ANGLE:
        return map_from_base[0], True
    columns = int((high_x - low_x) / _PLACE_SIZE) + 2
    rows = int((high_y - low_y) / _PLACE_SIZE) + 2
    gathered = np.zeros((rows, columns, _SECTORS))
    for i in range(len(weights)):
        row, column, sector = _place_of(map_from_base[i], low_x, low_y)
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
        row, column, sector = _place_of(map_from_base[i], low_x, low_y)
        if 0 <= row - at_row <= 1 and 0 <= column - at_column <= 1 and (sector - at_sector) % _SECTORS <= 1:
            center[0] += weights[i] * map_from_base[i, 0]
            center[1] += weights[i] * map_from_base[i, 1]
            sine += weights[i] * math.sin(map_from_base[i, 2])
            cosine += weights[i] * math.cos(map_from_base[i, 2])
    center[:2] /= heaviest
    center[2] = math.atan2(sine, cosine)
    return center, False


@njit(cache=True, nogil=True, inline="always")
def _place_of(map_from_base: Pose, low_x: float, low_y: float) -> tuple[int, int, int]:
    row = int((map_from_base[1] - low_y) / _PLACE_SIZE)
    column = int((map_from_base[0] - low_x) / _PLACE_SIZE)
    return row, column, int(_SECTORS * (map_from_base[2] / _TURN + 1.0)) % _SECTORS


@njit(cache=True, nogil=True, inline="always")
def _is_near(map_from_base: Pose, center: Pose) -> bool:
    dx, dy = map_from_base[0] - center[0], map_from_base[1] - center[1]
    return dx * dx + dy * dy < _RADIUS**2 and abs(wrapped(map_from_base[2] - center[2])) < _HALF_ANGLE
