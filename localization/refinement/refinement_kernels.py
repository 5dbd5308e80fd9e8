"""Gauss-Newton on the distance to walls."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from racecar.localization.floor.walls import WallField
from racecar.maps.geometry.se2 import Pose
from racecar.maps.geometry.se2_kernels import composed, inverse_of_symmetric, step_between

_FEWEST_POINTS = 10
"""Minimum number of end points, since fewer may all lie on one unmapped object. Chosen by judgement."""
_LARGEST_MOVE = 0.5
"""Largest correction in metres or radians, since farther away walls are different ones: about the width of a
tracked cloud. Chosen by judgement."""
_SCALES = (0.3, 0.2, 0.1, 0.1, 0.07, 0.07)
"""Scales in metres of the robust kernel, one per iteration: from wide, to find walls, to narrow, to ignore
people. Chosen by judgement; measured: alignment took session_A's error from 0.13 to 0.06 m."""
_WALL_NOISE = 0.05
"""Standard deviation in metres of a point on a wall, since walls are drawn to a cell of a usual map."""
_POINTS_PER_OBSERVATION = 4.0
"""Points per independent one, since neighbours lie on one wall and err alike. Chosen by judgement."""
_PER_POINT = 1.0 / (_WALL_NOISE**2 * _POINTS_PER_OBSERVATION)
"""Information of a point, by definition, one over metres squared."""
_CLOUD_WIDTH = 2.0
"""Factor by which the prior is wider than the cloud, since it saw the same scan. Chosen by judgement."""
_LEAST_CLOUD = 0.05
"""Metres or radians added to that width (in squares), so that a collapsed cloud does not fix the pose: a cell
of a usual map. Chosen by judgement."""
_BELIEF = 1.4
"""Factor by which the published covariance widens the cloud's, since correlated errors make it too narrow.
Measured on foreign drives: nearly all errors lie inside the 95 % ellipse, 89 % where wheels report half."""
_REACH, _REACH_CELLS = 0.25, 3.0
"""Metres, and minimum number of cells, of the finite differences of the misfit: more than the steps of an
oblique wall, less than a doorway. Measured: with 0.15 thick walls of cells of 5 cm at 37°, whose steps repeat
every 25 cm, leave half of the cloud's width, with 0.25 all of it."""
_BEYOND = 1e3
"""Distance in metres assumed off the grid, since nothing is known there: far."""
_ROUNDS = 2
"""Iterations to find the axes: two, since the second starts from axes along which differences are exact."""


@njit(cache=True, nogil=True)
def align_to_walls(
    map_from_base: Pose,
    covariance: NDArray[np.float64],
    points: NDArray[np.float64],
    walls: WallField,
) -> Pose:
    """The pose (3,) near a cloud's mean that aligns points (N, 2) with walls.

    One Gauss-Newton step per scale of the weights of Geman and McClure (1987). The cloud, with covariance (3,
    3), is the prior where walls do not constrain the pose, as along a corridor. The mean itself if points are
    too few or the alignment diverges.
    """
    if len(points) < _FEWEST_POINTS:
        return map_from_base
    map_from_grid = walls[0]
    start = step_between(map_from_grid, map_from_base)
    pose, turn = start.copy(), _rotation(map_from_grid[2])
    cloud = inverse_of_symmetric(_CLOUD_WIDTH**2 * covariance + _LEAST_CLOUD**2 * np.eye(3))
    cloud = turn.T @ cloud @ turn
    for scale in _SCALES:
        gradient, information = _normal_equations(pose, points, walls, scale)
        pose -= inverse_of_symmetric(cloud + information) @ (cloud @ (pose - start) + gradient)
    aligned = composed(map_from_grid, pose)
    x, y, yaw = step_between(map_from_base, aligned)
    return map_from_base if max(abs(x), abs(y), abs(yaw)) > _LARGEST_MOVE else aligned


@njit(cache=True, nogil=True)
def covariance_given_walls(
    map_from_base: Pose,
    covariance: NDArray[np.float64],
    points: NDArray[np.float64],
    walls: WallField,
) -> NDArray[np.float64]:
    """(3, 3) covariance of an aligned pose (3,), from that of a cloud (3, 3) and points (N, 2)."""
    turn = _rotation(walls[0][2])
    scan = turn @ _information(step_between(walls[0], map_from_base), points, walls) @ turn.T
    return inverse_of_symmetric(inverse_of_symmetric(_BELIEF**2 * covariance + 1e-6 * np.eye(3)) + scan)


@njit(cache=True, nogil=True)
def signed_distances(
    map_from_base: Pose,
    points: NDArray[np.float64],
    laser: NDArray[np.float64],
    walls: WallField,
) -> NDArray[np.float64]:
    """(N,) metres from points (N, 2) to walls, negative if these come no closer along the laser's beam."""
    pose = step_between(walls[0], map_from_base)
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    laser_x, laser_y = cos * laser[0] - sin * laser[1], sin * laser[0] + cos * laser[1]
    _, distances, per_metre, surface = walls
    signed = np.empty(len(points))
    for i in range(len(points)):
        x, y = cos * points[i, 0] - sin * points[i, 1], sin * points[i, 0] + cos * points[i, 1]
        signed[i], slope_x, slope_y = _distance(pose[0] + x, pose[1] + y, distances, per_metre, surface)
        if slope_x * (x - laser_x) + slope_y * (y - laser_y) >= 0.0:
            signed[i] = -signed[i]
    return signed


@njit(cache=True, nogil=True)
def _normal_equations(
    pose: Pose, points: NDArray[np.float64], walls: WallField, scale: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gradient (3,) and information (3, 3) of points (N, 2) at a pose on the grid."""
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    _, distances, per_metre, surface = walls
    g_x, g_y, g_t = 0.0, 0.0, 0.0  # as an array, each would wait for the last store
    i_xx, i_xy, i_xt, i_yy, i_yt, i_tt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(len(points)):
        x, y = cos * points[i, 0] - sin * points[i, 1], sin * points[i, 0] + cos * points[i, 1]
        distance, slope_x, slope_y = _distance(pose[0] + x, pose[1] + y, distances, per_metre, surface)
        slope_t = slope_y * x - slope_x * y
        weight = _PER_POINT / (1.0 + (distance / scale) ** 2) ** 2
        g_x += weight * slope_x * distance
        g_y += weight * slope_y * distance
        g_t += weight * slope_t * distance
        i_xx += weight * slope_x * slope_x
        i_xy += weight * slope_x * slope_y
        i_xt += weight * slope_x * slope_t
        i_yy += weight * slope_y * slope_y
        i_yt += weight * slope_y * slope_t
        i_tt += weight * slope_t * slope_t
    information = np.array([[i_xx, i_xy, i_xt], [i_xy, i_yy, i_yt], [i_xt, i_yt, i_tt]])
    return np.array([g_x, g_y, g_t]), information


@njit(cache=True, nogil=True)
def _information(pose: Pose, points: NDArray[np.float64], walls: WallField) -> NDArray[np.float64]:
    """(3, 3) information of points (N, 2) at an aligned pose on the grid: the curvature of their misfit.

    It uses finite differences over decimetres: on oblique walls, cells form stairs whose slopes point
    sideways. First the axes are found, then the curvature along each, as small differences of large numbers
    are inaccurate. Headings are scaled by their effect on points.
    """
    reach = max(_REACH, _REACH_CELLS / walls[2])
    steps = np.array([reach, reach, reach / math.sqrt((0.1 + (points**2).sum()) / len(points))])
    middle = _misfit(pose, points, walls, 2.0 * reach)
    ways, curvature = np.diag(steps), np.empty((3, 3))
    for _ in range(_ROUNDS):
        for i in range(3):
            curvature[i, i] = _rise(pose, ways[i], points, walls, 2.0 * reach, middle)
            for j in range(i):
                both = _rise(pose, ways[i] + ways[j], points, walls, 2.0 * reach, middle)
                curvature[i, j] = curvature[j, i] = 0.5 * (both - curvature[i, i] - curvature[j, j])
        ways = np.linalg.eigh(curvature)[1].T @ ways
    information = np.zeros((3, 3))
    for way in ways:
        told = max(_rise(pose, way, points, walls, 2.0 * reach, middle), 0.0)
        information += _PER_POINT * told * np.outer(way / steps**2, way / steps**2)
    return information


@njit(cache=True, nogil=True)
def _rise(
    pose: Pose,
    way: Pose,
    points: NDArray[np.float64],
    walls: WallField,
    scale: float,
    middle: float,
) -> float:
    """Increase of the misfit to both sides along a direction (3,)."""
    ahead, behind = _misfit(pose + way, points, walls, scale), _misfit(pose - way, points, walls, scale)
    return ahead + behind - 2.0 * middle


@njit(cache=True, nogil=True)
def _misfit(pose: Pose, points: NDArray[np.float64], walls: WallField, scale: float) -> float:
    """Half the squared distances of points (N, 2) to walls, each bounded by the scale."""
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    _, distances, per_metre, surface = walls
    total = 0.0
    for i in range(len(points)):
        x, y = cos * points[i, 0] - sin * points[i, 1], sin * points[i, 0] + cos * points[i, 1]
        distance, _, _ = _distance(pose[0] + x, pose[1] + y, distances, per_metre, surface)
        total += 0.5 * distance**2 / (1.0 + (distance / scale) ** 2)
    return total


@njit(cache=True, nogil=True)
def _distance(
    x: float, y: float, distances: NDArray[np.float32], per_metre: float, surface: float
) -> tuple[float, float, float]:
    """Bilinear distance in metres from a point on the grid to a wall's surface, and slopes on both axes."""
    column, row = x * per_metre - 0.5, y * per_metre - 0.5
    left, low = math.floor(column), math.floor(row)
    if not (0 <= left < distances.shape[1] - 1 and 0 <= low < distances.shape[0] - 1):
        return _BEYOND, 0.0, 0.0
    u, v = column - left, row - low
    a, b = np.float64(distances[low, left]), np.float64(distances[low, left + 1])
    c, d = np.float64(distances[low + 1, left]), np.float64(distances[low + 1, left + 1])
    lower, upper = a + u * (b - a), c + u * (d - c)
    distance = lower + v * (upper - lower)
    slope_x = ((b - a) + v * ((d - c) - (b - a))) * per_metre
    return distance - surface, slope_x, (upper - lower) * per_metre


@njit(cache=True, nogil=True)
def _rotation(yaw: float) -> NDArray[np.float64]:
    """(3, 3) rotation of x and y of a pose."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
