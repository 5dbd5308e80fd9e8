"""How particles move: an increment of the car's motion, and noise about it."""

import numpy as np
from numpy.typing import NDArray

from localization.motion_model_kernels import move_particles
from maps.se2 import Pose


def odometry_noise(base_from_next_base: Pose, noise: float) -> float:
    """Standard deviation (metres and radians) of a measured increment (3,).

    The variance grows with the motion, a radian counting as a metre, so a drive is as uncertain in
    many small steps as in few large ones, and a car that stands still gains no noise at all.
    """
    x, y, yaw = base_from_next_base
    return float(noise * np.sqrt(np.hypot(x, y) + abs(yaw)))


def drift_noise(seconds: float, noise: float) -> float:
    """Standard deviation (metres and radians) of an increment that nothing measured."""
    return float(noise * np.sqrt(seconds))


def move(map_from_base: Pose, base_from_next_base: Pose, deviation: float, rng: np.random.Generator) -> Pose:
    """Particles (N, 3) after an increment (3,); each draws noise of its own, in its own base frame."""
    if deviation == 0.0 and not np.any(base_from_next_base):
        return map_from_base
    noise = rng.standard_normal(map_from_base.shape, dtype=np.float32)
    moved: NDArray[np.float64] = move_particles(map_from_base, base_from_next_base, deviation, noise)
    return moved
