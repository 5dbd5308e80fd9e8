"""Sine and cosine that a compiler turns into vector instructions; the library's take one number at a time."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.geometry.se2_kernels import wrapped

_SINE = tuple((-1.0) ** n / math.factorial(2 * n + 1) for n in reversed(range(7)))
"""Coefficients of the powers of a² in Taylor's series of sin(a) / a, the highest first: seven, since for an
eighth of the turn the next term is below 3e-14."""
_VERSINE = tuple((-1.0) ** n / math.factorial(2 * n + 2) for n in reversed(range(7)))
"""The same of (1 - cos(a)) / a², since cosines near 1 would lose digits."""
BATCH = 256
"""Poses whose sines are taken together, so that vector instructions do it and it all fits the first cache."""


@njit(cache=True, nogil=True, inline="always")
def sin_cos(angle: float) -> tuple[float, float]:
    """Sine and cosine to 1e-14, of angles up to some thousand turns.

    By Taylor's series on an eighth of the turn about zero, doubled twice.
    """
    a = 0.25 * wrapped(angle)
    q = a * a
    sine, versine = 0.0, 0.0
    for coefficient in _SINE:
        sine = sine * q + coefficient
    for coefficient in _VERSINE:
        versine = versine * q + coefficient
    sine, cosine = a * sine, 1.0 - q * versine
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

    Returns how many there were.
    """
    count = min(BATCH, len(poses) - start)
    for k in range(count):
        yaw[k] = poses[start + k, 2]
    for k in range(count):
        sine[k], cosine[k] = sin_cos(yaw[k])
    return count
