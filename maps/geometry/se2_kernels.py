"""Planar poses inside compiled loops, one at a time, as `se2` has them for everything else."""

import math

import numpy as np
from numba import njit

from racecar.maps.geometry.se2 import Pose

_TURN = 2.0 * math.pi
_PER_RADIAN = 1.0 / _TURN


@njit(cache=True, nogil=True, inline="always")
def wrapped(angle: float) -> float:
    """The same angle in [-π, π)."""
    turns: float = np.floor(angle * _PER_RADIAN + 0.5)  # math's makes an integer, which no vector has
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
