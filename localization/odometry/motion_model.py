"""The car's motion between two moments and its error, which is normal in each coordinate of an increment."""

from dataclasses import dataclass, field
from math import hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.maps.geometry.se2 import Pose, adjoint, compose


@dataclass(frozen=True, eq=False)
class MotionStep:
    """The motion between two moments."""

    base_from_next_base: Pose
    deviations: Pose
    """(3,) standard deviations in metres and radians."""
    travel: float
    """Metres plus radians that the car may have moved; inf if nothing measured it."""
    seconds: float
    """inf if the clock was set back, so that the time is unknown."""
    effort: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))
    """(2,) effort of the tyres along and across the car, 0 to 1."""
    behind: Pose = field(default_factory=lambda: np.zeros(3))
    """(3,) to add to the motion if the car lags behind its odometry, see `slip`."""
    is_over_gap: bool = False
    """Whether enough time has passed for the car to have been carried anywhere."""


def odometry_deviations(base_from_next_base: Pose, config: LocalizationConfig) -> Pose:
    """(3,) standard deviations (metres, radians) of a measured increment (3,), excluding slip.

    The alphas are those of Thrun, Burgard and Fox: Probabilistic Robotics (2005), section 5.4. Here they
    yield variances proportional to the motion, not to its square, so that a drive is equally uncertain in
    many small steps or a few large ones. A standing car gains no noise at all.
    """
    path, turn = path_and_turn(base_from_next_base)
    place = path * config.path_noise_per_metre**2 + turn * config.path_noise_per_turn**2
    heading = path * config.turn_noise_per_metre**2 + turn * config.turn_noise_per_turn**2
    return np.array([sqrt(place), sqrt(place), sqrt(heading)])


def drift_deviations(seconds: float, config: LocalizationConfig) -> Pose:
    """(3,) standard deviations (metres, radians) of an unmeasured increment."""
    return np.full(3, config.drift_noise * np.sqrt(seconds))


def travel(base_from_next_base: Pose) -> float:
    """Size of an increment (3,): metres plus radians."""
    return sum(path_and_turn(base_from_next_base))


def path_and_turn(base_from_next_base: Pose) -> tuple[float, float]:
    """Metres and radians, both positive, of an increment (3,)."""
    x, y, yaw = base_from_next_base.tolist()
    return hypot(x, y), abs(yaw)


def carry(
    map_from_base: Pose,
    covariance: NDArray[np.float64],
    base_from_next_base: Pose,
    deviations: Pose,
) -> tuple[Pose, NDArray[np.float64]]:
    """Moves a map pose (3,) and its covariance (3, 3) by an increment (3,) with deviations (3,)."""
    carried = compose(map_from_base, base_from_next_base)
    shift_x, shift_y, _ = carried - map_from_base
    by_pose = np.array([[1.0, 0.0, -shift_y], [0.0, 1.0, shift_x], [0.0, 0.0, 1.0]])
    noise = adjoint([0.0, 0.0, map_from_base[2]]) * deviations
    return carried, by_pose @ covariance @ by_pose.T + noise @ noise.T
