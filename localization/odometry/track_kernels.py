"""Interpolating between samples of odometry."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.geometry.se2_kernels import step_between, wrapped
from racecar.maps.sensing.odometry import FASTEST, STALE_AFTER


@njit(cache=True, nogil=True)
def poses_at(stamps: NDArray[np.int64], poses: Pose, wanted: NDArray[np.int64], longest_ahead: float) -> Pose:
    """Poses (W, 3) at wanted stamps (W,), from those (N, 3) at ascending stamps (N,) in nanoseconds.

    Past the last one it goes on at the latest speed, for so many seconds at most.
    """
    told = np.empty((len(wanted), 3))
    last = len(stamps) - 1
    speed = _latest_speed(stamps, poses)
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


@njit(cache=True, nogil=True)
def _latest_speed(stamps: NDArray[np.int64], poses: Pose) -> Pose:
    """(3,) per second, between the last two; none where these are far apart or show that it was no motion."""
    last = len(stamps) - 1
    if last < 1 or stamps[last] - stamps[last - 1] >= STALE_AFTER:
        return np.zeros(3)
    speed = step_between(poses[last - 1], poses[last]) / ((stamps[last] - stamps[last - 1]) * 1e-9)
    return speed if np.abs(speed).max() < FASTEST else np.zeros(3)
