"""How particles move: an increment of the car's motion, and noise about it."""

import numpy as np

from localization.motion_model_kernels import move_particles
from maps.se2 import Pose


def odometry_noise(base_from_next_base: Pose, noise: float, slip: float) -> Pose:
    """(3,) standard deviations (metres, radians) of a measured increment (3,).

    The variance of ``noise`` grows with the motion, a radian counting as a metre, so that a drive is as
    uncertain in many small steps as in few large ones; ``slip`` is a share of each coordinate, for what
    wheels and steering get wrong for a while. A car that stands still gains no noise at all.
    """
    deviations: Pose = np.hypot(noise * np.sqrt(travel(base_from_next_base)), slip * base_from_next_base)
    return deviations


def travel(base_from_next_base: Pose) -> float:
    """How much an increment (3,) moves the car: metres plus radians."""
    x, y, yaw = base_from_next_base
    return float(np.hypot(x, y) + abs(yaw))


def drift_noise(seconds: float, noise: float) -> Pose:
    """(3,) standard deviations (metres, radians) of an increment that nothing measured."""
    return np.full(3, noise * np.sqrt(seconds))


def move(map_from_base: Pose, base_from_next_base: Pose, deviations: Pose, rng: np.random.Generator) -> Pose:
    """Particles (N, 3) after an increment (3,); each draws noise of its own, in its own base frame."""
    if not np.any(deviations) and not np.any(base_from_next_base):
        return map_from_base
    noise = rng.standard_normal(map_from_base.shape, dtype=np.float32)
    moved: Pose = move_particles(map_from_base, base_from_next_base, deviations, noise)
    return moved
