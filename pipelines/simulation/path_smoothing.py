"""Smooth a planned path while keeping its clearance from walls."""

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.polyline import resample
from racecar.maps.grid.distance_field import sample_field
from racecar.maps.grid.occupancy_grid import OccupancyGrid

STEP = 0.1
"""Metres between the points of a smoothed path."""
_ROUNDS = 400
"""Each moves all points to the midpoint of their neighbours; 400 spread a bend over some 20 points (2 m)."""
_WANTED_CLEARANCE = 0.65
"""Metres: the body, and a margin to steer at speed."""
_FIXED_ENDS = 4
"""Points at either end that stay fixed, so that a path starts and ends at the planned headings."""


def smooth_path(
    points: NDArray[np.float64], grid: OccupancyGrid, clearance: NDArray[np.float32]
) -> NDArray[np.float64]:
    """Points (M, 2), ``STEP`` apart, of a path (N, 2) pulled straight like an elastic band.

    No point moves to a clearance below 0.65 m, unless its clearance grows.
    """
    points = resample(points, STEP)
    if len(points) <= 2 * _FIXED_ENDS:
        return points
    movable = slice(_FIXED_ENDS, -_FIXED_ENDS)
    here = sample_field(clearance, grid, points[movable])
    for _ in range(_ROUNDS):
        middles = 0.5 * (points[:-2] + points[2:])
        pulled = middles[_FIXED_ENDS - 1 : len(middles) - _FIXED_ENDS + 1]
        there = sample_field(clearance, grid, pulled)
        allowed = (there >= _WANTED_CLEARANCE) | (there >= here)
        points[movable][allowed] = pulled[allowed]
        here = np.where(allowed, there, here)
    return resample(points, STEP)
