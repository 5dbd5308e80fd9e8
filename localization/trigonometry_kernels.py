"""Sine and cosine that a compiler turns into vector instructions; the library's take one number at a time."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from maps.se2 import Pose

_TURN = 2.0 * math.pi
_PER_RADIAN = 1.0 / _TURN
BATCH = 256
"""Poses whose sines are taken together, by vector instructions."""


@njit(cache=True, nogil=True, inline="always")
def wrapped(angle: float) -> float:
    """The same angle in [-π, π)."""
    return angle - _TURN * math.floor(angle * _PER_RADIAN + 0.5)


@njit(cache=True, nogil=True, inline="always")
def sin_cos(angle: float) -> tuple[float, float]:
    """Sine and cosine to 1e-14, of angles up to some thousand turns.

    By Taylor's series on an eighth of the turn about zero, doubled twice.
    """
    a = 0.25 * (angle - _TURN * math.floor(angle * _PER_RADIAN + 0.5))
    q = a * a
    sine = a * (
        1.0
        + q
        * (
            -1.0 / 6.0
            + q
            * (
                1.0 / 120.0
                + q * (-1.0 / 5040.0 + q * (1.0 / 362880.0 + q * (-1.0 / 39916800.0 + q / 6227020800.0)))
            )
        )
    )
    versine = q * (
        0.5
        + q
        * (
            -1.0 / 24.0
            + q
            * (
                1.0 / 720.0
                + q * (-1.0 / 40320.0 + q * (1.0 / 3628800.0 + q * (-1.0 / 479001600.0 + q / 87178291200.0)))
            )
        )
    )
    cosine = 1.0 - versine
    sine, cosine = 2.0 * sine * cosine, 1.0 - 2.0 * sine * sine
    return 2.0 * sine * cosine, 1.0 - 2.0 * sine * sine


@njit(cache=True, nogil=True)
def take_batch(
    poses: Pose,
    start: int,
    yaw: NDArray[np.float64],
    sine: NDArray[np.float64],
    cosine: NDArray[np.float64],
) -> int:
    """Fill the yaws of poses (N, 3) from ``start`` on, and their sines and cosines, into arrays (BATCH,).

    Tells how many there were.
    """
    count = min(BATCH, len(poses) - start)
    for k in range(count):
        yaw[k] = poses[start + k, 2]
    for k in range(count):
        sine[k], cosine[k] = sin_cos(yaw[k])
    return count
