"""The simulated car: what its body, engine and steering can do."""

import math
from dataclasses import dataclass

import numpy as np

WHEELBASE = 0.33
"""Metres, of a car at a scale of 1:10 as the course has it."""
MAX_STEERING = 0.4
"""Radians; the turning radius is then 0.78 m."""
MAX_STEERING_RATE = 3.2
"""Radians per second, of a servo that goes from lock to lock in a quarter of a second."""
MAX_ACCELERATION = 3.0
MAX_BRAKING = 4.0
"""m/s²; what motor and brakes do."""
MAX_SIDE_ACCELERATION = 6.0
"""m/s²; what the tyres hold in a bend."""

BODY_CENTERS = np.array([[0.0, 0.0], [0.3, 0.0]])
"""Two discs on the car's axis that cover its body, metres; base_link is in the middle of the rear axle."""
BODY_RADIUS = 0.2
"""Metres, of each disc."""


@dataclass
class Car:
    """A kinematic bicycle: the pose of the rear axle's middle, moved by speed and steering."""

    x: float
    y: float
    yaw: float
    speed: float = 0.0
    steering: float = 0.0

    @property
    def turning_speed(self) -> float:
        """Radians per second."""
        return self.speed * math.tan(self.steering) / WHEELBASE

    def move(self, wanted_speed: float, wanted_steering: float, seconds: float) -> None:
        """Go on for a short time towards the wanted speed (m/s) and steering angle, along an exact arc."""
        rate = MAX_BRAKING if abs(wanted_speed) < abs(self.speed) else MAX_ACCELERATION
        self.speed = _towards(wanted_speed, self.speed, rate * seconds)
        wanted_steering = min(max(wanted_steering, -MAX_STEERING), MAX_STEERING)
        self.steering = _towards(wanted_steering, self.steering, MAX_STEERING_RATE * seconds)
        turn, distance = self.turning_speed * seconds, self.speed * seconds
        chord = distance if abs(turn) < 1e-9 else distance * math.sin(turn / 2) / (turn / 2)
        self.x += chord * math.cos(self.yaw + turn / 2)
        self.y += chord * math.sin(self.yaw + turn / 2)
        self.yaw += turn


def steering_for(speed: float, turning_speed: float) -> float:
    """The angle (rad) at which a car of that speed (m/s) turns so fast (rad/s); it may be more than the
    steering allows. A car that stands steers as far as it can."""
    if speed == 0.0:
        return math.copysign(MAX_STEERING, turning_speed) if turning_speed else 0.0
    return math.atan(WHEELBASE * turning_speed / speed)


def _towards(wanted: float, now: float, step: float) -> float:
    return now + min(max(wanted - now, -step), step)
