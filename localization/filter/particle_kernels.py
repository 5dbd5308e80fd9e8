"""Loops over the particles for each scan."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.geometry.se2_kernels import wrapped


@njit(cache=True, nogil=True)
def move_particles(
    map_from_base: Pose,
    slips: NDArray[np.float64],
    base_from_next_base: Pose,
    behind: Pose,
    deviations: Pose,
    noise: NDArray[np.float32],
) -> Pose:
    """Particles (N, 3) moved by an increment (3,), with slips (N, 3) of distance, turn and lag.

    Each increment has added noise (N, 3) of unit variance, scaled by deviations (3,).
    """
    measured_forward, measured_left, measured_turn = base_from_next_base
    behind_forward, behind_left, behind_turn = behind
    forward_deviation, left_deviation, turn_deviation = deviations
    moved = np.empty_like(map_from_base)
    for i in range(len(map_from_base)):
        scale, turning, lag = 1.0 + slips[i, 0], 1.0 + slips[i, 1], slips[i, 2]
        forward = scale * measured_forward + lag * behind_forward + forward_deviation * noise[i, 0]
        left = scale * measured_left + lag * behind_left + left_deviation * noise[i, 1]
        turn = turning * measured_turn + lag * behind_turn + turn_deviation * noise[i, 2]
        cos, sin = math.cos(map_from_base[i, 2]), math.sin(map_from_base[i, 2])
        moved[i, 0] = map_from_base[i, 0] + cos * forward - sin * left
        moved[i, 1] = map_from_base[i, 1] + sin * forward + cos * left
        moved[i, 2] = wrapped(map_from_base[i, 2] + turn)
    return moved


@njit(cache=True, nogil=True)
def moments_about(
    center: Pose, map_from_base: Pose, weights: NDArray[np.float64], radius: float, half_angle: float
) -> tuple[Pose, NDArray[np.float64], float]:
    """Mean (3,), covariance (3, 3) and weight of particles (N, 3) near a pose (3,); nan if there are none."""
    total, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for i in range(len(weights)):
        x, y = map_from_base[i, 0] - center[0], map_from_base[i, 1] - center[1]
        turn = wrapped(map_from_base[i, 2] - center[2])
        if x * x + y * y < radius * radius and abs(turn) < half_angle:
            offset = (x, y, turn)
            total += weights[i]
            for row in range(3):
                first[row] += weights[i] * offset[row]
                for column in range(3):
                    second[row, column] += weights[i] * offset[row] * offset[column]
    off = first / total
    mean = center + off
    mean[2] = wrapped(mean[2])
    return mean, second / total - off.reshape(3, 1) * off, total


@njit(cache=True, nogil=True)
def in_heaviest_block(
    squares: NDArray[np.int64], sectors: NDArray[np.int64], turn: int, weights: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """(N,) particles in the heaviest block of two by two squares and two sectors.

    Squares (N, 2) count from 0; sectors (N,) are cyclic with ``turn`` of them.
    """
    columns, rows = squares[:, 0].max() + 2, squares[:, 1].max() + 2
    blocks = np.zeros((columns, rows, turn))  # indexed by the second square and sector
    for i in range(len(weights)):
        x, y = squares[i]
        for before in range(2):
            sector = (sectors[i] + before) % turn
            blocks[x, y, sector] += weights[i]
            blocks[x + 1, y, sector] += weights[i]
            blocks[x, y + 1, sector] += weights[i]
            blocks[x + 1, y + 1, sector] += weights[i]
    heaviest = blocks.argmax()
    sector, y, x = heaviest % turn, heaviest // turn % rows, heaviest // (turn * rows)
    is_there = np.empty(len(weights), dtype=np.bool_)
    for i in range(len(weights)):
        is_near = 0 <= x - squares[i, 0] <= 1 and 0 <= y - squares[i, 1] <= 1
        is_there[i] = is_near and (sector - sectors[i]) % turn <= 1
    return is_there
