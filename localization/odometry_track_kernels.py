"""Interpolating between samples of odometry."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from localization.trigonometry_kernels import wrapped
from maps.se2 import Pose


@njit(cache=True, nogil=True)
def poses_at(
    stamps: NDArray[np.int64], poses: Pose, speed: Pose, wanted: NDArray[np.int64], longest_ahead: float
) -> Pose:
    """Poses (W, 3) at wanted stamps (W,), from those (N, 3) at ascending stamps (N,) in nanoseconds.

    Past the last one it goes on at a speed (3,) for so many seconds at most.
    """
    told = np.empty((len(wanted), 3))
    last = len(stamps) - 1
    for i in range(len(wanted)):
        right = np.searchsorted(stamps, wanted[i])
        if right > last:
            ahead = min((wanted[i] - stamps[last]) * 1e-9, longest_ahead)
            cos, sin = math.cos(poses[last, 2]), math.sin(poses[last, 2])
            told[i, 0] = poses[last, 0] + ahead * (cos * speed[0] - sin * speed[1])
            told[i, 1] = poses[last, 1] + ahead * (sin * speed[0] + cos * speed[1])
            told[i, 2] = wrapped(poses[last, 2] + ahead * speed[2])
        elif right == 0:
            told[i, 0], told[i, 1], told[i, 2] = poses[0, 0], poses[0, 1], poses[0, 2]
        else:
            left = right - 1
            share = (wanted[i] - stamps[left]) / (stamps[right] - stamps[left])
            told[i, 0] = poses[left, 0] + share * (poses[right, 0] - poses[left, 0])
            told[i, 1] = poses[left, 1] + share * (poses[right, 1] - poses[left, 1])
            told[i, 2] = wrapped(poses[left, 2] + share * wrapped(poses[right, 2] - poses[left, 2]))
    return told
