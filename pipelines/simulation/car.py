"""The simulated car: limits of its body, motor and steering."""

import math
from dataclasses import dataclass

import numpy as np

WHEELBASE = 0.33
"""Metres; a car at a scale of 1:10, as in the course."""
MAX_STEERING = 0.4
"""Radians; the minimum turning radius is then 0.78 m."""
MAX_STEERING_RATE = 3.2
"""Radians per second; a servo that goes from lock to lock in a quarter of a second."""
MAX_ACCELERATION = 3.0
MAX_BRAKING = 4.0
"""m/s²; the limit of motor and brakes."""
MAX_SIDE_ACCELERATION = 6.0
"""m/s²; the limit of the tyres in a bend."""

BODY_CENTERS = np.array([[0.0, 0.0], [0.3, 0.0]])
"""Metres, centres of two discs that cover the car's body; base_link is at the rear axle's centre."""
BODY_RADIUS = 0.2
"""Metres, of each disc."""


@dataclass
class Car:
    """A kinematic bicycle model: the pose of the rear axle's centre, driven by speed and steering."""

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
        """Move along an exact arc, with speed (m/s) and steering angle (rad) approaching the wanted ones."""
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
    """Steering angle (rad) for a speed (m/s) and turning speed (rad/s); may exceed the steering's limit. A
    standing car steers as far as it can."""
    if speed == 0.0:
        return math.copysign(MAX_STEERING, turning_speed) if turning_speed else 0.0
    return math.atan(WHEELBASE * turning_speed / speed)


def _towards(wanted: float, now: float, step: float) -> float:
    return now + min(max(wanted - now, -step), step)
