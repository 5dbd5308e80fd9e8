"""Gauss-Newton on the distance to walls."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.geometry.se2_kernels import wrapped
from racecar.maps.geometry.symmetric_kernels import inverse_of_symmetric


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
    scales: NDArray[np.float64],
    wall_noise: float,
    points_per_observation: float,
    cloud_width: float,
    least_cloud: float,
) -> tuple[Pose, NDArray[np.float64]]:
    """The pose (3,) near a cloud's mean that brings points (N, 2) to the walls, and its covariance (3, 3).

    ``distances`` (rows, columns) are metres to the centre of the nearest occupied cell. In drawn maps the
    surface is half a cell before that, in maps made from scans it is there: a quarter is in between.
    One Gauss-Newton step for each of the ``scales`` (S,), metres, of the weights of Geman and McClure (1987);
    the cloud holds the pose where walls do not, as along a corridor. For the others see `AlignmentConfig`.
    """
    pose = map_from_base.copy()
    turn_cos, turn_sin = math.cos(grid_from_map[2]), math.sin(grid_from_map[2])
    per_metre, per_point = 1.0 / resolution, 1.0 / (wall_noise**2 * points_per_observation)
    widened = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            widened[i, j] = cloud_width**2 * covariance[i, j]
        widened[i, i] += least_cloud**2
    cloud = inverse_of_symmetric(widened)
    information = cloud.copy()
    gradient = np.zeros(3)
    for scale in scales:
        information = cloud.copy()
        for i in range(3):
            gradient[i] = 0.0
            for j in range(3):
                gradient[i] += cloud[i, j] * (pose[j] - map_from_base[j])
        column = (grid_from_map[0] + turn_cos * pose[0] - turn_sin * pose[1]) * per_metre - 0.5
        row = (grid_from_map[1] + turn_sin * pose[0] + turn_cos * pose[1]) * per_metre - 0.5
        cos, sin = math.cos(pose[2]), math.sin(pose[2])
        grid_cos, grid_sin = math.cos(grid_from_map[2] + pose[2]), math.sin(grid_from_map[2] + pose[2])
        g_x, g_y, g_yaw = 0.0, 0.0, 0.0  # in an array each would wait for the store before
        i_xx, i_xy, i_xt, i_yy, i_yt, i_tt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(len(points_in_base)):
            x, y = points_in_base[i, 0], points_in_base[i, 1]
            distance, slope_right, slope_up = _sample(
                distances,
                column + per_metre * (grid_cos * x - grid_sin * y),
                row + per_metre * (grid_sin * x + grid_cos * y),
            )
            if distance < 0.0:
                continue
            distance = max(distance - 0.25 * resolution, 0.0)
            slope_x = (turn_cos * slope_right + turn_sin * slope_up) * per_metre
            slope_y = (turn_cos * slope_up - turn_sin * slope_right) * per_metre
            slope_yaw = slope_y * (cos * x - sin * y) - slope_x * (sin * x + cos * y)
            weight = per_point / (1.0 + (distance / scale) ** 2) ** 2
            g_x += weight * slope_x * distance
            g_y += weight * slope_y * distance
            g_yaw += weight * slope_yaw * distance
            i_xx += weight * slope_x * slope_x
            i_xy += weight * slope_x * slope_y
            i_xt += weight * slope_x * slope_yaw
            i_yy += weight * slope_y * slope_y
            i_yt += weight * slope_y * slope_yaw
            i_tt += weight * slope_yaw * slope_yaw
        gradient += np.array((g_x, g_y, g_yaw))
        information[0] += np.array((i_xx, i_xy, i_xt))
        information[1, 1:] += np.array((i_yy, i_yt))
        information[2, 2] += i_tt
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
    a, b = np.float64(distances[low, left]), np.float64(distances[low, left + 1])
    c, d = np.float64(distances[low + 1, left]), np.float64(distances[low + 1, left + 1])
    lower, upper = a + u * (b - a), c + u * (d - c)
    return lower + v * (upper - lower), (b - a) + v * ((d - c) - (b - a)), upper - lower
