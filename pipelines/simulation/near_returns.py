"""What a laser sees right beside it that moves along with it: posts of the robot's own, a carrier's body."""

import numpy as np
from numpy.typing import NDArray

from racecar.pipelines.simulation.laser_models import LaserModel
from racecar.pipelines.simulation.laser_sensor import range_to_disc

_POST_RADIUS = 0.015
_NEAREST_POST, _FARTHEST_POST = 0.18, 0.35
"""Metres, as the posts are of a robot that bears a plate above its laser."""
_BODY, _BODY_BULGE = 0.25, 0.05
"""Metres to a carrier's body, more or less, as in a recording of a carried robot: 0.2 to 0.3 m."""
_BODY_PERIOD = 1.1
"""Seconds of a carrier's two steps, in which the body sways."""


def see_posts(number: int, laser: LaserModel, generator: np.random.Generator) -> NDArray[np.float64]:
    """(beams,) metres to the robot's own posts, each in a part of the view of its own; inf between them."""
    part = np.radians(laser.field_of_view) / max(number, 1)
    ranges = np.full(laser.beams, np.inf)
    for post in range(number):
        bearing = laser.angle_min + part * (post + generator.uniform(0.1, 0.9))
        distance = generator.uniform(_NEAREST_POST, _FARTHEST_POST)
        center = distance * np.array([np.cos(bearing), np.sin(bearing)])
        seen = range_to_disc(np.zeros((1, 3)), laser.bearings, center, _POST_RADIUS)
        ranges = np.minimum(ranges, seen)
    return ranges


def see_carrier(laser: LaserModel, seconds: float) -> NDArray[np.float64]:
    """(beams,) metres to the body of who carries the robot, on the rear half of the beams; inf elsewhere."""
    sway = 2.0 * np.pi * seconds / _BODY_PERIOD
    body = _BODY + _BODY_BULGE * np.sin(3.0 * laser.bearings + 0.5 * np.sin(sway))
    is_ahead = np.abs(laser.bearings) < np.radians(laser.field_of_view) / 4
    return np.where(is_ahead, np.inf, body)
