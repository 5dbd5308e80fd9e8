"""How measured motion errs: normally, in each coordinate of an increment."""

from math import hypot, sqrt

import numpy as np

from racecar.localization.config import LocalizationConfig
from racecar.maps.geometry.se2 import Pose


def odometry_deviations(base_from_next_base: Pose, config: LocalizationConfig) -> Pose:
    """(3,) standard deviations (metres, radians) of a measured increment (3,), besides the slip.

    The alphas are those of Thrun, Burgard and Fox: Probabilistic Robotics (2005), section 5.4. Here they
    give variances that grow with the motion and not with its square, so that a drive is as uncertain in many
    small steps as in few large ones. A car that stands still gains no noise at all.
    """
    path, turn = _path_and_turn(base_from_next_base)
    place = path * config.path_noise_per_metre**2 + turn * config.path_noise_per_turn**2
    heading = path * config.turn_noise_per_metre**2 + turn * config.turn_noise_per_turn**2
    return np.array([sqrt(place), sqrt(place), sqrt(heading)])


def drift_deviations(seconds: float, config: LocalizationConfig) -> Pose:
    """(3,) standard deviations (metres, radians) of an increment that nothing measured."""
    return np.full(3, config.drift_noise * np.sqrt(seconds))


def travel(base_from_next_base: Pose) -> float:
    """How much an increment (3,) moves the car: metres plus radians."""
    return sum(_path_and_turn(base_from_next_base))


def _path_and_turn(base_from_next_base: Pose) -> tuple[float, float]:
    x, y, yaw = base_from_next_base.tolist()
    return hypot(x, y), abs(yaw)
