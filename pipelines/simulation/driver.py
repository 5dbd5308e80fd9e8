"""The driver: follows a path by pure pursuit, slows down for bends, and changes gear where the path reverses.

R. C. Coulter: Implementation of the Pure Pursuit Path Tracking Algorithm, CMU-RI-TR-92-01, 1992.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.polyline import lengths_along
from racecar.maps.geometry.se2 import Pose, wrap_angle
from racecar.maps.grid.distance_field import sample_field
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.simulation.car import MAX_BRAKING, MAX_SIDE_ACCELERATION, MAX_STEERING, WHEELBASE, Car
from racecar.pipelines.simulation.driving_lattice import Route
from racecar.pipelines.simulation.path_smoothing import STEP, smooth_path

TICK = 0.005
"""Seconds between the poses of a drive."""
TICKS_PER_DECISION = 4
"""Ticks between decisions: 50 a second, as for a controller on a car."""
_REVERSE_SPEED = 0.8
"""m/s."""
_CREEPING_SPEED = 0.25
"""m/s at which the car approaches the end of a leg, which it would never reach by braking alone."""
_SEARCHED = 15
"""Points of the path, 1.5 m, searched for the one nearest to the car, as the path may come by again."""
_NEAREST_TARGET, _FARTHEST_TARGET = 0.45, 2.5
"""Metres ahead to the pure pursuit target: nearer the car oscillates, farther it cuts corners."""
_LOOK_AHEAD_SECONDS = 0.3
"""Seconds of driving by which the target moves ahead with the speed."""
_CAUTION = 0.7
"""Share of the limits of brakes and tyres that the driver uses."""


@dataclass(frozen=True, eq=False)
class CarMotion:
    """The motion of a car, every ``TICK`` seconds."""

    map_from_base: Pose
    """(N, 3)"""
    speed: NDArray[np.float64]
    """(N,) m/s, negative in reverse."""
    turning_speed: NDArray[np.float64]
    """(N,) rad/s."""

    @property
    def seconds(self) -> float:
        """Seconds from the first pose to the last."""
        return (len(self.speed) - 1) * TICK


@dataclass(frozen=True, eq=False)
class _Leg:
    """A part of a path that is driven in one gear."""

    points: NDArray[np.float64]
    """(N, 2), ``STEP`` apart."""
    speed: NDArray[np.float64]
    """(N,) speed limit at each point, m/s."""
    gear: int
    """1 or -1 for reverse."""


def drive_route(
    route: Route,
    grid: OccupancyGrid,
    clearance: NDArray[np.float32],
    max_speed: float,
    rounds: int = 1,
    max_seconds: float = math.inf,
) -> CarMotion:
    """Drive a route ``rounds`` times and stop at its end, or drive until ``max_seconds`` are over."""
    start = route.map_from_base[0]
    car = Car(*start)
    record = [(car.x, car.y, car.yaw, car.speed, car.turning_speed)]
    for speed, steering in follow_route(car, route, grid, clearance, max_speed, rounds):
        for _ in range(TICKS_PER_DECISION):
            car.move(speed, steering, TICK)
            record.append((car.x, car.y, car.yaw, car.speed, car.turning_speed))
        if len(record) * TICK >= max_seconds:
            return _as_drive(record)
    return _as_drive(record)


def follow_route(
    car: Car,
    route: Route,
    grid: OccupancyGrid,
    clearance: NDArray[np.float32],
    max_speed: float,
    rounds: int = 1,
) -> Iterator[tuple[float, float]]:
    """Wanted speed (m/s) and steering (rad), each for the next `TICKS_PER_DECISION`, until the car reaches
    the end of the route; the caller moves the car in between."""
    for leg in _legs(route, rounds, grid, clearance, max_speed):
        yield from _follow(car, leg)


def _as_drive(record: list[tuple[float, float, float, float, float]]) -> CarMotion:
    columns = np.array(record)
    poses = columns[:, :3].copy()
    poses[:, 2] = wrap_angle(poses[:, 2])
    return CarMotion(poses, columns[:, 3], columns[:, 4])


def _legs(
    route: Route, rounds: int, grid: OccupancyGrid, clearance: NDArray[np.float32], max_speed: float
) -> Iterator[_Leg]:
    """Each leg is smoothed when the car reaches its start, since a short drive needs few of them."""
    points = np.concatenate([route.map_from_base[:1, :2]] + [route.map_from_base[1:, :2]] * rounds)
    backwards = np.concatenate([route.backwards[1:]] * rounds)
    changes = np.flatnonzero(np.diff(backwards)) + 1
    for first, last in zip([0, *changes], [*changes, len(backwards)], strict=True):
        path = smooth_path(points[first : last + 1], grid, clearance)
        gear = -1 if backwards[first] else 1
        room = sample_field(clearance, grid, path)
        limit = np.minimum(max_speed if gear > 0 else _REVERSE_SPEED, _speed_in_narrow(room))
        yield _Leg(path, _allowed_speed(path, np.minimum(limit, max_speed)), gear)


def _speed_in_narrow(room: NDArray[np.float32]) -> NDArray[np.float64]:
    """(N,) m/s at which the driver passes walls at distances (N,)."""
    return np.maximum(1.5, 2.0 + 10.0 * (room.astype(np.float64) - 0.45))


def _allowed_speed(points: NDArray[np.float64], limit: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N,) a limit (N,) reduced for the tyres in bends, and for the brakes before bends and the end."""
    along = lengths_along(points)
    ahead, behind = np.minimum(along + 0.4, along[-1]), np.maximum(along - 0.4, 0.0)
    reach = [
        np.stack([np.interp(s, along, axis) for axis in points.T], axis=1) for s in (behind, along, ahead)
    ]
    before, after = reach[1] - reach[0], reach[2] - reach[1]
    turn = wrap_angle(np.arctan2(after[:, 1], after[:, 0]) - np.arctan2(before[:, 1], before[:, 0]))
    curvature = np.abs(turn) / np.maximum(0.5 * (ahead - behind), STEP)
    curvature[(along < 0.2) | (along > along[-1] - 0.2)] = 0.0
    in_bends = np.sqrt(_CAUTION * MAX_SIDE_ACCELERATION / np.maximum(curvature, 1e-6))
    allowed: NDArray[np.float64] = np.minimum(in_bends, limit)
    allowed[-1] = 0.0
    gain = 2.0 * _CAUTION * MAX_BRAKING * np.diff(along)
    for i in range(len(points) - 2, -1, -1):
        allowed[i] = min(allowed[i], math.sqrt(allowed[i + 1] ** 2 + gain[i]))
    return allowed


def _follow(car: Car, leg: _Leg) -> Iterator[tuple[float, float]]:
    """Wanted speed and steering, one decision at a time, until the car reaches the end of the leg."""
    direction = leg.points[-1] - leg.points[-2]
    direction /= np.linalg.norm(direction)
    beyond = leg.points[-1] + direction * STEP * np.arange(1, 40)[:, None]
    points, last = np.concatenate([leg.points, beyond]), len(leg.points) - 1
    nearest = 0
    while True:
        window = points[nearest : nearest + _SEARCHED]
        nearest += int(np.argmin(np.hypot(window[:, 0] - car.x, window[:, 1] - car.y)))
        to_go = float(direction @ (leg.points[-1] - (car.x, car.y)))
        if nearest >= last - 5 and to_go <= 0.02:
            yield from _stop(car)
            return
        speed = max(float(leg.speed[min(nearest, last)]), _CREEPING_SPEED)
        look_ahead = min(max(_NEAREST_TARGET, _LOOK_AHEAD_SECONDS * abs(car.speed) + 0.2), _FARTHEST_TARGET)
        target = points[min(nearest + max(1, round(look_ahead / STEP)), len(points) - 1)]
        yield leg.gear * speed, _steering_towards(car, target)


def _stop(car: Car) -> Iterator[tuple[float, float]]:
    while car.speed != 0.0:
        yield 0.0, car.steering


def _steering_towards(car: Car, target: NDArray[np.float64]) -> float:
    """Steering angle for which the rear axle's arc, forwards or backwards, meets the target."""
    x, y = target[0] - car.x, target[1] - car.y
    aside = -math.sin(car.yaw) * x + math.cos(car.yaw) * y
    curvature = 2.0 * aside / max(x * x + y * y, 1e-6)
    return min(max(math.atan(WHEELBASE * curvature), -MAX_STEERING), MAX_STEERING)
