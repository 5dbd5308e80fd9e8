"""The loops over the particles of the motion models."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.localization.numerics.noise_kernels import noise
from racecar.localization.numerics.trigonometry_kernels import BATCH, take_batch
from racecar.maps.geometry.se2 import Pose
from racecar.maps.geometry.se2_kernels import wrapped


@njit(cache=True, nogil=True, fastmath={"contract"})
def move_particles(
    map_from_base: Pose,
    slips: NDArray[np.float64],
    base_from_next_base: Pose,
    behind: Pose,
    deviations: Pose,
    seed: np.uint32,
) -> Pose:
    """Particles (N, 3) moved by an increment (3,), by slips (N, 3) of distance, turn and lag.

    Each also draws noise of deviations (3,).
    """
    # Read here, because the compiler must assume that the loop writes to these arrays.
    measured_forward, measured_left, measured_turn = base_from_next_base
    behind_forward, behind_left, behind_turn = behind
    noise_forward, noise_left, noise_turn = deviations
    moved = np.empty_like(map_from_base)
    yaw, sine, cosine = np.empty(BATCH), np.empty(BATCH), np.empty(BATCH)
    drawn = np.empty(3 * BATCH)
    for start in range(0, len(map_from_base), BATCH):
        count = take_batch(map_from_base, start, yaw, sine, cosine)
        for k in range(3 * count):
            drawn[k] = noise(seed, 3 * start + k)
        for k in range(count):
            i = start + k
            scale, turning, lag = 1.0 + slips[i, 0], 1.0 + slips[i, 1], slips[i, 2]
            forward = scale * measured_forward + lag * behind_forward + noise_forward * drawn[3 * k]
            left = scale * measured_left + lag * behind_left + noise_left * drawn[3 * k + 1]
            turn = turning * measured_turn + lag * behind_turn + noise_turn * drawn[3 * k + 2]
            moved[i, 0] = map_from_base[i, 0] + cosine[k] * forward - sine[k] * left
            moved[i, 1] = map_from_base[i, 1] + sine[k] * forward + cosine[k] * left
            moved[i, 2] = wrapped(yaw[k] + turn)
    return moved


@njit(cache=True, nogil=True)
def disturb_particles(map_from_base: Pose, first: int, every: int, deviations: Pose, seed: np.uint32) -> None:
    """Add noise of deviations (3,), in the map, to every few of the particles (N, 3).

    To those of number ``first``, ``first + every`` and so on.
    """
    for i in range(first, len(map_from_base), every):
        for axis in range(3):
            map_from_base[i, axis] += deviations[axis] * noise(seed, 3 * (i // every) + axis)


@njit(cache=True, nogil=True)
def carry(
    map_from_base: Pose,
    covariance: NDArray[np.float64],
    base_from_next_base: Pose,
    deviations: Pose,
) -> tuple[Pose, NDArray[np.float64]]:
    """A pose (3,) and its covariance (3, 3) in the map, after an increment (3,) with deviations (3,)."""
    yaw = map_from_base[2]
    cos, sin = math.cos(yaw), math.sin(yaw)
    forward, left, turn = base_from_next_base
    shift_x, shift_y = cos * forward - sin * left, sin * forward + cos * left
    carried = np.empty(3)
    carried[0], carried[1] = map_from_base[0] + shift_x, map_from_base[1] + shift_y
    carried[2] = wrapped(yaw + turn)
    turned, axes = np.zeros((3, 3)), np.zeros((3, 3))
    turned[0, 0] = turned[1, 1] = turned[2, 2] = 1.0
    turned[0, 2], turned[1, 2] = -shift_y, shift_x
    axes[0, 0], axes[0, 1] = cos * deviations[0], -sin * deviations[1]
    axes[1, 0], axes[1, 1] = sin * deviations[0], cos * deviations[1]
    axes[2, 2] = deviations[2]
    grown = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                grown[i, j] += axes[i, k] * axes[j, k]
                for m in range(3):
                    grown[i, j] += turned[i, k] * covariance[k, m] * turned[j, m]
    return carried, grown
