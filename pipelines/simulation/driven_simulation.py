"""A simulated drive controlled while it runs: by clicked goals, or by hand."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from racecar.maps.errors import UserError
from racecar.maps.geometry.se2 import IDENTITY, Pose, between, compose, inverse, transform_points, wrap_angle
from racecar.maps.grid.distance_field import sample_field
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.simulation import laser_sensor
from racecar.pipelines.simulation.car import BODY_CENTERS, BODY_RADIUS, MAX_BRAKING, Car
from racecar.pipelines.simulation.driver import TICK, TICKS_PER_DECISION, CarMotion, follow_route
from racecar.pipelines.simulation.driving_lattice import DrivingLattice
from racecar.pipelines.simulation.laser_models import LASERS
from racecar.pipelines.simulation.routes import choose_start, route_to_goal
from racecar.pipelines.simulation.simulator import START_NS
from racecar.pipelines.simulation.simulator_config import DrivingConditions, LaserKind
from racecar.pipelines.simulation.walkers import LEG_RADIUS, Walkers
from racecar.pipelines.simulation.wheel_odometry import PERIOD_TICKS, Wheels, efforts
from racecar.sensors.measurement import Measurement
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

_SCAN_PERIOD = 0.05
"""Seconds between the sweeps that are used, if the laser turns that fast: 20 a second of the race car's 40
leave a laptop time for localizer and mapper."""
_HAND_SECONDS = 0.6
"""Seconds for which a manual command holds, so that closing the page stops the car."""
_ROOM_AHEAD, _LANE = 0.9, 0.35
"""Metres in front of ``base_link``, in addition to the stopping distance, and to either side, in which a
person makes the car brake."""
_COVERED_RANGE = 0.0
"""Metres measured by a covered laser: less than its minimum range, even with noise."""


class Conditions(DrivingConditions):
    """Conditions that can be changed during the drive; also ROS parameters."""

    dropped_scans: float = Field(0.0, ge=0.0, le=1.0, description="Share of the scans that never arrive.")
    is_blocked: bool = Field(False, description="Whether something covers the laser.")


class DrivenSimulation:
    """A car in a world; its measurements arrive as from a bag: a scan follows the odometry that covers it."""

    def __init__(
        self,
        grid: OccupancyGrid,
        conditions: Conditions,
        seed: int = 0,
        start: Pose | None = None,
        laser: LaserKind = LaserKind.RACE,
    ) -> None:
        """``start`` (3,): the car starts near it. Raises UserError when the map has no room for it."""
        self.conditions = conditions
        self.start_ns = START_NS
        """Nanoseconds, the stamp of the start of the drive."""
        self.laser = LASERS[laser]
        self._sweeps_apart = max(1, round(_SCAN_PERIOD / self.laser.scan_time))
        self._grid = grid
        self._lattice = DrivingLattice(grid)
        self._generator = np.random.default_rng(seed)
        pose = self._lattice.poses_of(np.array([choose_start(grid, self._lattice, start)]))[0]
        self._car = Car(*pose)
        self._noise, self._wheels = conditions.noise, Wheels(conditions.noise, self._generator)
        self._walkers = Walkers(0, self._lattice, self._generator)
        self._legs = np.zeros((0, 2))
        self._tick, self._owed = 0, 0.0
        self._odom_from_base = IDENTITY
        self._hand: tuple[float, float] | None = None
        self._hand_until = 0.0
        self._decisions: Iterator[tuple[float, float]] | None = None
        self._wanted = (0.0, 0.0)
        self.planned = np.zeros((0, 2))
        """(N, 2) the path to the goal."""
        self._trace: list[tuple[float, float, float]] = []
        self._trace_tick = self._sweep_tick = 0
        self._last = self.truth, 0.0, 0.0
        self._begin_trace()

    @property
    def truth(self) -> Pose:
        """(3,) ``map_from_base``."""
        car = self._car
        return np.array([car.x, car.y, float(wrap_angle(car.yaw))])

    @property
    def speed(self) -> float:
        """m/s."""
        return self._car.speed

    @property
    def turning_speed(self) -> float:
        """rad/s."""
        return self._car.turning_speed

    @property
    def seconds(self) -> float:
        """Seconds since the drive began."""
        return self._tick * TICK

    @property
    def legs(self) -> NDArray[np.float64]:
        """(2 * walkers, 2) positions of the walkers' legs."""
        return self._legs

    @property
    def is_underway(self) -> bool:
        """Whether the car is driving to a goal."""
        return self._decisions is not None

    @property
    def is_steered(self) -> bool:
        """Whether the last manual command still holds."""
        return self._hand is not None and self.seconds < self._hand_until

    def change(self, **conditions: Any) -> None:
        """Change conditions, by name, from the next period on."""
        self.conditions = self.conditions.model_copy(update=conditions)

    def drive_to(self, goal: NDArray[np.float64]) -> None:
        """Drive to a place (2,), or to a pose (3,). Raises UserError when the car cannot stand there."""
        route = route_to_goal(self._lattice, self.truth, goal)
        self._hand = None
        self.planned = route.map_from_base[:, :2]
        if len(self.planned) < 2:
            self.stop()
            return
        self._decisions = follow_route(
            self._car, route, self._grid, self._lattice.clearance, self.conditions.max_speed
        )

    def steer(self, speed: float, steering: float) -> None:
        """Drive by hand, in m/s and radians, for a moment."""
        self.stop()
        self._hand = speed, steering
        self._hand_until = self.seconds + _HAND_SECONDS

    def stop(self) -> None:
        """Brake, and forget the goal."""
        self._decisions, self._hand = None, None
        self.planned = np.zeros((0, 2))

    def put_at(self, map_from_base: Pose) -> None:
        """Carry the car to a pose (3,), unnoticed by wheels and laser. Raises UserError when it cannot stand
        there."""
        if self._room_at(map_from_base) < BODY_RADIUS:
            raise UserError("The car does not fit there; choose free floor.")
        self.stop()
        self._car.x, self._car.y, self._car.yaw = map_from_base.tolist()
        self._car.speed, self._car.steering = 0.0, 0.0
        self._begin_trace()

    def kidnap(self) -> None:
        """Carry the car to a random place."""
        node = self._generator.choice(np.flatnonzero(self._lattice.reachable))
        self.put_at(self._lattice.poses_of(np.array([node]))[0])

    def advance(self, seconds: float) -> list[Measurement]:
        """Advance the simulation; returns the measurements of that time."""
        self._heed_conditions()
        self._owed += seconds
        measured: list[Measurement] = []
        while self._owed >= PERIOD_TICKS * TICK:
            self._owed -= PERIOD_TICKS * TICK
            self._move()
            measured.append(self._odometry())
            measured += self._scans()
        return measured

    def _heed_conditions(self) -> None:
        conditions = self.conditions
        if conditions.noise != self._noise:
            self._noise, self._wheels = conditions.noise, Wheels(conditions.noise, self._generator)
        if 2 * conditions.walkers != len(self._legs):
            self._walkers = Walkers(conditions.walkers, self._lattice, self._generator)
            self._legs = self._walkers.walk(0.0)

    def _move(self) -> None:
        """Move for one period of the odometry, which is also that of the driver's decisions."""
        speed, steering = self._decide()
        for _ in range(TICKS_PER_DECISION):
            before = self._car.x, self._car.y, self._car.yaw
            self._car.move(speed, steering, TICK)
            if self._room_at(np.array([self._car.x, self._car.y, self._car.yaw])) < BODY_RADIUS / 2:
                self._car.x, self._car.y, self._car.yaw = before
                self._car.speed = 0.0
            self._tick += 1
            self._trace.append((self._car.x, self._car.y, self._car.yaw))

    def _decide(self) -> tuple[float, float]:
        """Wanted speed and steering."""
        if self._hand is not None and self.is_steered:
            speed, steering = self._hand
            return (0.0 if self._is_someone_ahead(speed) else speed), steering
        if self._decisions is None:
            return 0.0, self._car.steering
        if self._is_someone_ahead(self._wanted[0]):
            return 0.0, self._car.steering
        decision = next(self._decisions, None)
        if decision is None:
            self.stop()
            return 0.0, self._car.steering
        self._wanted = decision
        return decision

    def _is_someone_ahead(self, speed: float) -> bool:
        """Whether a person stands where the car is about to drive."""
        if len(self._legs) == 0 or speed == 0.0:
            return False
        reach = _ROOM_AHEAD + self._car.speed**2 / MAX_BRAKING
        x, y = transform_points(inverse(self.truth), self._legs).T
        return bool(np.any((x * math.copysign(1.0, speed) > 0.0) & (np.abs(x) < reach) & (np.abs(y) < _LANE)))

    def _room_at(self, map_from_base: Pose) -> float:
        """Metres from the body's centres to the nearest wall."""
        discs = transform_points(map_from_base, BODY_CENTERS)
        return float(sample_field(self._lattice.clearance, self._grid, discs).min())

    def _odometry(self) -> Odometry:
        pose, speed, turning_speed = self.truth, self._car.speed, self._car.turning_speed
        last_pose, last_speed, last_turning = self._last
        self._last = pose, speed, turning_speed
        effort = efforts(np.array([last_speed, speed]), np.array([last_turning, turning_speed]))
        step = self._wheels.measure(between(last_pose, pose)[None], effort, self.conditions.slip)[0]
        self._odom_from_base = compose(self._odom_from_base, step)
        return Odometry(self._stamp(self._tick), self._odom_from_base, step / (PERIOD_TICKS * TICK))

    def _scans(self) -> list[Scan]:
        """The sweep newly covered by the last odometry, if any."""
        ticks_of_sweep = math.ceil(self.laser.time_offsets[-1] / TICK) + 1
        if self._tick < self._sweep_tick + ticks_of_sweep:
            return []
        start, self._sweep_tick = (
            self._sweep_tick,
            self._sweep_tick + self._sweeps_apart * self.laser.period_ticks,
        )
        poses = np.array(self._trace[start - self._trace_tick :])
        del self._trace[: max(0, self._sweep_tick - self._trace_tick)]
        self._trace_tick = max(self._trace_tick, min(self._sweep_tick, self._tick + 1))
        legs = self._legs
        self._legs = self._walkers.walk(self._sweeps_apart * self.laser.scan_time)
        if self._generator.random() < self.conditions.dropped_scans:
            return []
        return [self._sweep(start, poses, legs)]

    def _sweep(self, tick: int, poses: Pose, legs: NDArray[np.float64]) -> Scan:
        laser = self.laser
        motion = CarMotion(poses, np.zeros(len(poses)), np.zeros(len(poses)))
        map_from_base = laser_sensor.poses_at_beams(motion, 0, laser)
        if self.conditions.is_blocked:
            ranges = np.full(laser.beams, _COVERED_RANGE)
        else:
            ranges = laser_sensor.see_walls(self._grid, map_from_base, laser)
            laser_sensor.see_legs(ranges, map_from_base, laser, (legs, legs), LEG_RADIUS)
        measured = laser_sensor.measure(ranges, laser, laser.noise, laser.dropouts, self._generator)
        measured[measured < laser.range_min] = np.nan
        return laser.scan(self._stamp(tick), measured)

    def _begin_trace(self) -> None:
        """Discard the motion so far, since no sweep may extend over the moment when the car was carried."""
        self._trace = [(self._car.x, self._car.y, self._car.yaw)]
        self._trace_tick = self._sweep_tick = self._tick
        self._last = self.truth, 0.0, 0.0

    def _stamp(self, tick: int) -> int:
        return self.start_ns + round(tick * TICK * 1e9)
