"""The planar poses of `se2`, one at a time, for compiled loops."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose

_TURN = 2.0 * math.pi
_PER_RADIAN = 1.0 / _TURN


@njit(cache=True, nogil=True, inline="always")
def wrapped(angle: float) -> float:
    """Wrap an angle to [-π, π)."""
    turns: float = np.floor(angle * _PER_RADIAN + 0.5)  # math.floor returns an integer, which no vector has
    return angle - _TURN * turns


@njit(cache=True, nogil=True)
def composed(a_from_b: Pose, b_from_c: Pose) -> Pose:
    """``a_from_c`` (3,)."""
    cos, sin = math.cos(a_from_b[2]), math.sin(a_from_b[2])
    x, y, yaw = b_from_c
    return np.array(
        [a_from_b[0] + cos * x - sin * y, a_from_b[1] + sin * x + cos * y, wrapped(a_from_b[2] + yaw)]
    )


@njit(cache=True, nogil=True)
def step_between(world_from_a: Pose, world_from_b: Pose) -> Pose:
    """``a_from_b`` (3,)."""
    dx, dy = world_from_b[0] - world_from_a[0], world_from_b[1] - world_from_a[1]
    cos, sin = math.cos(world_from_a[2]), math.sin(world_from_a[2])
    return np.array([cos * dx + sin * dy, cos * dy - sin * dx, wrapped(world_from_b[2] - world_from_a[2])])


@njit(cache=True, nogil=True)
def inverse_of_symmetric(symmetric: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inverse (3, 3) of a symmetric matrix (3, 3) by cofactors; only its upper triangle is read."""
    a, b, c = symmetric[0, 0], symmetric[0, 1], symmetric[0, 2]
    d, e, f = symmetric[1, 1], symmetric[1, 2], symmetric[2, 2]
    inverse = np.empty((3, 3))
    inverse[0, 0], inverse[0, 1], inverse[0, 2] = d * f - e * e, c * e - b * f, b * e - c * d
    inverse[1, 1], inverse[1, 2], inverse[2, 2] = a * f - c * c, b * c - a * e, a * d - b * b
    determinant = a * inverse[0, 0] + b * inverse[0, 1] + c * inverse[0, 2]
    for i in range(3):
        for j in range(i, 3):
            inverse[i, j] /= determinant
            inverse[j, i] = inverse[i, j]
    return inverse
