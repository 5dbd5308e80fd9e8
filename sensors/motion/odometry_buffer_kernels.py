"""Kernels that interpolate between odometry samples and extrapolate past the last."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose


@njit(cache=True, nogil=True)
def poses_at(
    stamps: NDArray[np.int64],
    poses: Pose,
    wanted: NDArray[np.int64],
    lag: int,
    last_speed: Pose,
    longest_ahead: int,
) -> Pose:
    """Poses (W, 3) at requested stamps (W,), from poses (N, 3) at ascending stamps (N,).

    All times are in nanoseconds; samples are stamped late by ``lag``. Past the last sample the car moves at
    ``last_speed`` (3,), metres and radians per nanosecond in its own frame, for at most ``longest_ahead``.
    """
    found = np.empty((len(wanted), 3))
    last = len(stamps) - 1
    is_past = len(wanted) == 0 or np.min(wanted) + lag >= stamps[last]
    for i in range(len(wanted)):
        at = wanted[i] + lag
        if is_past or last == 0:
            found[i] = poses[last]
        else:
            right = min(max(np.searchsorted(stamps, at, side="right"), 1), last)
            left = right - 1
            share = min(max((at - stamps[left]) / (stamps[right] - stamps[left]), 0.0), 1.0)
            found[i, 0] = poses[left, 0] + share * (poses[right, 0] - poses[left, 0])
            found[i, 1] = poses[left, 1] + share * (poses[right, 1] - poses[left, 1])
            found[i, 2] = _wrapped(poses[left, 2] + share * _wrapped(poses[right, 2] - poses[left, 2]))
        if longest_ahead > 0:
            ahead = min(max(at - stamps[last], 0), longest_ahead)
            x, y = ahead * last_speed[0], ahead * last_speed[1]
            cos, sin = math.cos(found[i, 2]), math.sin(found[i, 2])
            found[i, 0] = found[i, 0] + cos * x - sin * y
            found[i, 1] = found[i, 1] + sin * x + cos * y
            found[i, 2] = _wrapped(found[i, 2] + ahead * last_speed[2])
    return found


@njit(cache=True, nogil=True)
def last_speed(
    stamps: NDArray[np.int64], poses: Pose, speed_over: int, widest_gap: int, fastest: float
) -> Pose:
    """(3,) metres and radians per nanosecond, in the car's frame at the last of poses (N, 3) at stamps (N,).

    The mean since the latest sample that is ``speed_over`` nanoseconds older, or since any older one. Zero if
    these are ``widest_gap`` or more apart, or faster than ``fastest`` per second, which is no real motion.
    """
    last = len(stamps) - 1
    if last < 1:
        return np.zeros(3)
    older = np.searchsorted(stamps, stamps[last] - speed_over, side="right") - 1
    before = min(max(older, 0), last - 1)
    gap = stamps[last] - stamps[before]
    if gap >= widest_gap:
        return np.zeros(3)
    speed = _between(poses[before], poses[last]) / gap
    return speed if np.max(np.abs(speed)) * 1e9 < fastest else np.zeros(3)


@njit(cache=True, nogil=True)
def _between(world_from_a: Pose, world_from_b: Pose) -> Pose:
    """``a_from_b`` (3,), rounded exactly as `racecar.maps.geometry.se2.between` does."""
    x, y, yaw = world_from_a
    cos, sin = math.cos(yaw), math.sin(yaw)
    a_from_world_x, a_from_world_y, turn = -cos * x - sin * y, sin * x - cos * y, _wrapped(-yaw)
    cos, sin = math.cos(turn), math.sin(turn)
    x, y, yaw = world_from_b
    return np.array(
        [a_from_world_x + cos * x - sin * y, a_from_world_y + sin * x + cos * y, _wrapped(turn + yaw)]
    )


@njit(cache=True, nogil=True)
def _wrapped(angle: float) -> float:
    """The same angle in (-π, π], rounded exactly as `racecar.maps.geometry.se2.wrap_angle` does, so that
    poses match those of `interpolate` and `compose` there to the bit."""
    return math.pi - (math.pi - angle) % (2.0 * math.pi)
