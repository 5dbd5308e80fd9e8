"""The loop over the particles of the motion model."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from maps.se2 import Pose


@njit(cache=True, nogil=True)
def move_particles(
    map_from_base: Pose, base_from_next_base: Pose, deviations: Pose, noise: NDArray[np.float32]
) -> Pose:
    """Particles (N, 3) moved by an increment (3,) and by deviations (3,) times ``noise`` (N, 3)."""
    moved = np.empty_like(map_from_base)
    for i in range(len(map_from_base)):
        forward = base_from_next_base[0] + deviations[0] * noise[i, 0]
        left = base_from_next_base[1] + deviations[1] * noise[i, 1]
        turn = base_from_next_base[2] + deviations[2] * noise[i, 2]
        yaw = map_from_base[i, 2]
        cos, sin = math.cos(yaw), math.sin(yaw)
        moved[i, 0] = map_from_base[i, 0] + cos * forward - sin * left
        moved[i, 1] = map_from_base[i, 1] + sin * forward + cos * left
        moved[i, 2] = math.pi - (math.pi - yaw - turn) % (2.0 * math.pi)
    return moved
