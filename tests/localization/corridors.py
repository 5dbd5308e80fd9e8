"""Corridors between bare walls, which scans say nothing of along them."""

import numpy as np

from racecar.localization.sensor.end_points import EndPoints
from racecar.maps.geometry.se2 import Pose, compose
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid

HALF_WIDTH = 1.2
_HALF_SIZE = 22.0
SIGHT = 12.0
"""Metres; less than to either end from within some metres of the middle."""


def slanted_corridor(
    degrees: float, resolution: float, *, thickness: float = 0.2, with_doors: bool = False
) -> OccupancyGrid:
    """44 m square with the corridor through its middle, which is the map's origin.

    Its walls have a thickness in metres, and the doors are gaps of a metre in both.
    """
    count = round(2.0 * _HALF_SIZE / resolution)
    y, x = (np.indices((count, count)) + 0.5) * resolution - _HALF_SIZE
    yaw = np.radians(degrees)
    along, across = np.cos(yaw) * x + np.sin(yaw) * y, np.cos(yaw) * y - np.sin(yaw) * x
    is_wall = (np.abs(across) >= HALF_WIDTH) & (np.abs(across) < HALF_WIDTH + thickness)
    if with_doors:
        is_wall &= (np.abs(along - 2.0) > 0.5) & (np.abs(along + 1.0) > 0.5)
    cells = np.where(is_wall, OCCUPIED, FREE).astype(np.int8)
    return OccupancyGrid(cells, resolution, np.array([-_HALF_SIZE, -_HALF_SIZE, 0.0]))


def seen_in_corridor(
    degrees: float, along: float, across: float, rng: np.random.Generator
) -> tuple[Pose, EndPoints]:
    """Where the car is, facing along, and what it sees of ideal bare walls, to within a centimetre."""
    bearings = np.linspace(-2.35, 2.35, 100)
    to_wall = np.where(bearings > 0.0, HALF_WIDTH - across, HALF_WIDTH + across)
    ranges = to_wall / np.abs(np.sin(bearings)) + rng.normal(0.0, 0.01, len(bearings))
    met = ranges <= SIGHT
    ends = ranges[:, None] * np.column_stack([np.cos(bearings), np.sin(bearings)])
    pose = compose(np.array([0.0, 0.0, np.radians(degrees)]), [along, across, 0.0])
    return pose, EndPoints(ends[met], np.zeros(2))
