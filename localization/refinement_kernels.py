"""Gauss-Newton on the distance to walls."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from localization.trigonometry_kernels import wrapped
from maps.se2 import Pose
from maps.symmetric_kernels import inverse_of_symmetric

_SCALES = (0.3, 0.2, 0.1, 0.1, 0.07, 0.07)
"""Metres beyond which a point counts less and less; one step each."""
_WALL_NOISE = 0.05
"""Metres: how strongly one point on a wall holds the pose."""
_POINTS_PER_WITNESS = 4.0
"""Neighbouring points lie on the same wall and err alike: so many tell as much as one."""
_CLOUD_WIDTH = 2.0
_LEAST_CLOUD = 0.05
"""The cloud holds the pose as if it were so many times as wide, and at least so many metres or radians: it
has seen the same scan, and shares the sensor model's errors."""


@njit(cache=True, nogil=True)
def points_of(
    bearings: NDArray[np.float64], ranges: NDArray[np.float64], base_from_laser: Pose
) -> NDArray[np.float64]:
    """(N, 2) where the beams (B,) that met something end, in the base frame."""
    points = np.empty((len(bearings), 2))
    count = 0
    for beam in range(len(bearings)):
        if math.isfinite(ranges[beam]):
            direction = base_from_laser[2] + bearings[beam]
            points[count, 0] = base_from_laser[0] + ranges[beam] * math.cos(direction)
            points[count, 1] = base_from_laser[1] + ranges[beam] * math.sin(direction)
            count += 1
    return points[:count]


@njit(cache=True, nogil=True)
def align_to_walls(
    map_from_base: Pose,
    covariance: NDArray[np.float64],
    grid_from_map: Pose,
    points_in_base: NDArray[np.float64],
    distances: NDArray[np.float32],
    resolution: float,
) -> tuple[Pose, NDArray[np.float64]]:
    """The pose (3,) near a cloud's mean that brings points (N, 2) to the walls, and its covariance (3, 3).

    ``distances`` (rows, columns) are metres to the centre of the nearest occupied cell. In drawn maps the
    surface is half a cell before that, in maps made from scans it is there: a quarter is between.
    Weights of Geman and McClure; the cloud holds the pose where walls do not, as along a corridor.
    """
    pose = map_from_base.copy()
    turn_cos, turn_sin = math.cos(grid_from_map[2]), math.sin(grid_from_map[2])
    held = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            held[i, j] = _CLOUD_WIDTH**2 * covariance[i, j]
        held[i, i] += _LEAST_CLOUD**2
    cloud = inverse_of_symmetric(held)
    information = cloud.copy()
    gradient = np.zeros(3)
    for scale in _SCALES:
        information = cloud.copy()
        for i in range(3):
            gradient[i] = 0.0
            for j in range(3):
                gradient[i] += cloud[i, j] * (pose[j] - map_from_base[j])
        x = grid_from_map[0] + turn_cos * pose[0] - turn_sin * pose[1]
        y = grid_from_map[1] + turn_sin * pose[0] + turn_cos * pose[1]
        cos, sin = math.cos(pose[2]), math.sin(pose[2])
        for i in range(len(points_in_base)):
            dx = cos * points_in_base[i, 0] - sin * points_in_base[i, 1]
            dy = sin * points_in_base[i, 0] + cos * points_in_base[i, 1]
            distance, slope_x, slope_y = _sample(
                distances,
                (x + turn_cos * dx - turn_sin * dy) / resolution - 0.5,
                (y + turn_sin * dx + turn_cos * dy) / resolution - 0.5,
            )
            if distance < 0.0:
                continue
            distance = max(distance - 0.25 * resolution, 0.0)
            weight = 1.0 / ((1.0 + (distance / scale) ** 2) ** 2 * _WALL_NOISE**2 * _POINTS_PER_WITNESS)
            slope_x, slope_y = (
                (turn_cos * slope_x + turn_sin * slope_y) / resolution,
                (turn_cos * slope_y - turn_sin * slope_x) / resolution,
            )
            slope_yaw = slope_y * dx - slope_x * dy
            gradient[0] += weight * slope_x * distance
            gradient[1] += weight * slope_y * distance
            gradient[2] += weight * slope_yaw * distance
            information[0, 0] += weight * slope_x * slope_x
            information[0, 1] += weight * slope_x * slope_y
            information[0, 2] += weight * slope_x * slope_yaw
            information[1, 1] += weight * slope_y * slope_y
            information[1, 2] += weight * slope_y * slope_yaw
            information[2, 2] += weight * slope_yaw * slope_yaw
        uncertainty = inverse_of_symmetric(information)
        for i in range(3):
            for j in range(3):
                pose[i] -= uncertainty[i, j] * gradient[j]
    pose[2] = wrapped(pose[2])
    return pose, inverse_of_symmetric(information)


@njit(cache=True, nogil=True)
def _sample(distances: NDArray[np.float32], column: float, row: float) -> tuple[float, float, float]:
    """Bilinear distance and its slopes per column and row; a distance of -1 outside the field."""
    left, low = math.floor(column), math.floor(row)
    if not (0 <= left < distances.shape[1] - 1 and 0 <= low < distances.shape[0] - 1):
        return -1.0, 0.0, 0.0
    u, v = column - left, row - low
    a, b = distances[low, left], distances[low, left + 1]
    c, d = distances[low + 1, left], distances[low + 1, left + 1]
    distance = (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d)
    return distance, (1 - v) * (b - a) + v * (d - c), (1 - u) * (c - a) + u * (d - b)
