"""How particles move: an increment of the car's motion, and noise about it."""

from dataclasses import dataclass
from math import hypot, sqrt
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.numerics.noise_kernels import random_seed
from racecar.localization.odometry.motion_model_kernels import drive_particles, move_particles
from racecar.localization.odometry.motion_step import MotionStep
from racecar.maps.geometry.se2 import Pose


class MotionModel(Protocol):
    """What is known of how measured motion errs."""

    def deviations(self, base_from_next_base: Pose) -> Pose:
        """(3,) standard deviations (metres, radians) of a measured increment (3,), besides the slip."""

    def move(
        self, map_from_base: Pose, slips: NDArray[np.float64], step: MotionStep, rng: np.random.Generator
    ) -> Pose:
        """Particles (N, 3) after a step, each by its own slips (N, 3), see `slip_kernels`.

        Each also draws noise of its own, in its own base frame.
        """


@dataclass(frozen=True)
class OdometryModel:
    """The increment errs in each coordinate.

    The alphas are those of Thrun, Burgard and Fox: Probabilistic Robotics (2005), section 5.4. Here they
    give variances that grow with the motion and not with its square, so that a drive is as uncertain in many
    small steps as in few large ones. A car that stands still gains no noise at all.
    """

    config: LocalizationConfig

    def deviations(self, base_from_next_base: Pose) -> Pose:
        """(3,) standard deviations (metres, radians) of a measured increment (3,), besides the slip."""
        path, turn = _path_and_turn(base_from_next_base)
        config = self.config
        place = path * config.path_noise_per_metre**2 + turn * config.path_noise_per_turn**2
        heading = path * config.turn_noise_per_metre**2 + turn * config.turn_noise_per_turn**2
        return np.array([sqrt(place), sqrt(place), sqrt(heading)])

    def move(
        self, map_from_base: Pose, slips: NDArray[np.float64], step: MotionStep, rng: np.random.Generator
    ) -> Pose:
        """Particles (N, 3) after a step, each by its own slips (N, 3)."""
        seed = random_seed(rng)
        return move_particles(
            map_from_base, slips, step.base_from_next_base, step.behind, step.deviations, seed
        )


@dataclass(frozen=True)
class AckermannModel:
    """The speed errs and the steering does: the car goes on along an arc, never sideways.

    A particle that goes farther turns further, and one that stands cannot turn.
    """

    config: LocalizationConfig

    def deviations(self, base_from_next_base: Pose) -> Pose:
        """(3,) standard deviations (metres, radians) along the arc, across it (none) and of the heading."""
        path, turn = _path_and_turn(base_from_next_base)
        steering = np.arctan2(self.config.wheelbase * turn, max(path, 1e-6))
        along = np.sqrt(path) * self.config.path_noise_per_metre
        return np.array([along, 0.0, np.sqrt(path) * self.config.turn_noise_per_metre / np.cos(steering)])

    def move(
        self, map_from_base: Pose, slips: NDArray[np.float64], step: MotionStep, rng: np.random.Generator
    ) -> Pose:
        """Particles (N, 3) after a step, each with its own speed, steering and slips (N, 3)."""
        if step.deviations[1] > 0.0:  # nothing measured it, so it may have gone anywhere
            return OdometryModel(self.config).move(map_from_base, slips, step, rng)
        seed = random_seed(rng)
        return drive_particles(
            map_from_base, slips, step.base_from_next_base, step.behind, step.deviations, seed
        )


def motion_model(config: LocalizationConfig) -> MotionModel:
    """The model that the settings name."""
    return AckermannModel(config) if config.motion_model == "ackermann" else OdometryModel(config)


def travel(base_from_next_base: Pose) -> float:
    """How much an increment (3,) moves the car: metres plus radians."""
    return sum(_path_and_turn(base_from_next_base))


def drift_noise(seconds: float, noise: float) -> Pose:
    """(3,) standard deviations (metres, radians) of an increment that nothing measured."""
    return np.full(3, noise * np.sqrt(seconds))


def _path_and_turn(base_from_next_base: Pose) -> tuple[float, float]:
    x, y, yaw = base_from_next_base.tolist()
    return hypot(x, y), abs(yaw)
