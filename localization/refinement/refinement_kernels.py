"""Gauss-Newton on the distance to walls."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.geometry.se2_kernels import wrapped
from racecar.maps.geometry.symmetric_kernels import inverse_of_symmetric

_SCALES = (0.3, 0.2, 0.1, 0.1, 0.07, 0.07)
"""Metres from a wall, one per step, beyond which a point counts less and less: from wide, to find the walls,
to narrow, to leave out people. By judgement; measured: alignment took session_A's error from 0.13 to 0.06
m."""
_WALL_NOISE = 0.05
"""Metres of standard deviation of a point on a wall, since walls are drawn to a cell of a usual map."""
_POINTS_PER_OBSERVATION = 4.0
"""Points that together count as one, since neighbours lie on the same wall and err alike. By judgement."""
_PER_POINT = 1.0 / (_WALL_NOISE**2 * _POINTS_PER_OBSERVATION)
"""Information of a point, by definition, one over metres squared."""
_CLOUD_WIDTH = 2.0
"""The cloud holds the pose as if this many times as wide, since it saw the same scan. By judgement."""
_LEAST_CLOUD = 0.05
"""Metres, or radians, added to that width (in squares), so that a cloud that collapsed does not hold it: a
cell of a usual map. By judgement."""
_BELIEF = 1.4
"""The cloud counts as so many times as wide in the covariance that is told, since it has learned from scans
that err alike. Measured on foreign drives: nearly all errors lie inside the 95 % ellipse, 89 % where wheels
tell half."""
_REACH, _REACH_CELLS = 0.25, 2.5
"""Metres, and at least so many cells, by which a pose is moved to see how much worse the scan fits: farther
than the steps of a slanted wall, and less than a doorway. Measured: with 0.15 thick walls of cells of 5 cm at
37°, whose steps repeat every 25 cm, leave half of the cloud's width, with 0.25 all of it."""
_ROUNDS = 2
"""Of finding the axes: two, since the second starts from axes along which differences are exact."""


@njit(cache=True, nogil=True)
def align_to_walls(
    map_from_base: Pose,
    covariance: NDArray[np.float64],
    grid_from_map: Pose,
    points_in_base: NDArray[np.float64],
    distances: NDArray[np.float32],
    resolution: float,
    surface: float,
) -> Pose:
    """The pose (3,) near a cloud's mean that brings points (N, 2) to the walls.

    ``distances`` (rows, columns) are metres to the centre of the nearest occupied cell, of
    which the ``surface`` is so many metres before. One
    Gauss-Newton step for each of the scales of the weights of Geman and McClure (1987); the cloud, of some
    covariance (3, 3), holds the pose where walls do not, as along a corridor.
    """
    pose = map_from_base.copy()
    turn_cos, turn_sin = math.cos(grid_from_map[2]), math.sin(grid_from_map[2])
    per_metre = 1.0 / resolution
    cloud = inverse_of_symmetric(_CLOUD_WIDTH**2 * covariance + _LEAST_CLOUD**2 * np.eye(3))
    gradient = np.zeros(3)
    for scale in _SCALES:
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
            distance = max(distance - surface, 0.0)
            slope_x = (turn_cos * slope_right + turn_sin * slope_up) * per_metre
            slope_y = (turn_cos * slope_up - turn_sin * slope_right) * per_metre
            slope_yaw = slope_y * (cos * x - sin * y) - slope_x * (sin * x + cos * y)
            weight = _PER_POINT / (1.0 + (distance / scale) ** 2) ** 2
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
    return pose


@njit(cache=True, nogil=True)
def covariance_given_walls(
    pose: Pose,
    covariance: NDArray[np.float64],
    grid_from_map: Pose,
    points: NDArray[np.float64],
    distances: NDArray[np.float32],
    resolution: float,
    surface: float,
) -> NDArray[np.float64]:
    """(3, 3) of a pose (3,) that fits, by what a cloud of some covariance (3, 3) and points (N, 2) say."""
    scan = _information(pose, grid_from_map, points, distances, resolution, surface)
    return inverse_of_symmetric(inverse_of_symmetric(_BELIEF**2 * covariance + 1e-6 * np.eye(3)) + scan)


@njit(cache=True, nogil=True)
def _information(
    pose: Pose,
    grid_from_map: Pose,
    points: NDArray[np.float64],
    distances: NDArray[np.float32],
    resolution: float,
    surface: float,
) -> NDArray[np.float64]:
    """(3, 3) what points (N, 2) say of a pose (3,) that fits: the curvature of their misfit over decimetres.

    The slopes between cells would say more, since on a slanted wall, whose cells are stairs, they point
    aside. First the axes are found, then the curvature along each, as small differences of large ones are not
    to be trusted. Headings count by what they do to points.
    """
    lever = 0.1
    for i in range(len(points)):
        lever += points[i, 0] ** 2 + points[i, 1] ** 2
    scale = np.array([1.0, 1.0, 1.0 / math.sqrt(lever / len(points))])
    reach = max(_REACH, _REACH_CELLS * resolution)
    field = (grid_from_map, points, distances, resolution, 2.0 * reach, surface)
    middle = _misfit(pose, field)
    ways = np.eye(3)
    ahead, behind, curvature = np.empty(3), np.empty(3), np.empty((3, 3))
    for _ in range(_ROUNDS):
        for axis in range(3):
            way = reach * ways[axis] * scale
            ahead[axis], behind[axis] = _misfit(pose + way, field), _misfit(pose - way, field)
            curvature[axis, axis] = ahead[axis] + behind[axis] - 2.0 * middle
        for i in range(3):
            for j in range(i):
                way = reach * (ways[i] + ways[j]) * scale
                both = _misfit(pose + way, field) + _misfit(pose - way, field)
                both -= ahead[i] + ahead[j] + behind[i] + behind[j] - 2.0 * middle
                curvature[i, j] = curvature[j, i] = 0.5 * both
        ways = np.linalg.eigh(curvature)[1].T @ ways
    information = np.zeros((3, 3))
    for axis in range(3):
        way = reach * ways[axis] * scale
        told = max(_misfit(pose + way, field) + _misfit(pose - way, field) - 2.0 * middle, 0.0)
        for i in range(3):
            for j in range(3):
                information[i, j] += (
                    _PER_POINT * told / reach**2 * ways[axis, i] * ways[axis, j] / (scale[i] * scale[j])
                )
    return information


@njit(cache=True, nogil=True)
def _misfit(
    pose: Pose, field: tuple[Pose, NDArray[np.float64], NDArray[np.float32], float, float, float]
) -> float:
    """Half the squared distances of points (N, 2) to walls, none of which counts for more than the scale."""
    grid_from_map, points, distances, resolution, scale, surface = field
    cos, sin = math.cos(grid_from_map[2] + pose[2]), math.sin(grid_from_map[2] + pose[2])
    turn_cos, turn_sin = math.cos(grid_from_map[2]), math.sin(grid_from_map[2])
    right = (grid_from_map[0] + turn_cos * pose[0] - turn_sin * pose[1]) / resolution - 0.5
    up = (grid_from_map[1] + turn_sin * pose[0] + turn_cos * pose[1]) / resolution - 0.5
    total = 0.0
    for i in range(len(points)):
        x, y = points[i, 0] / resolution, points[i, 1] / resolution
        distance, _, _ = _sample(distances, right + cos * x - sin * y, up + sin * x + cos * y)
        if distance >= 0.0:
            distance = max(distance - surface, 0.0)
            total += 0.5 * distance**2 / (1.0 + (distance / scale) ** 2)
    return total


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
