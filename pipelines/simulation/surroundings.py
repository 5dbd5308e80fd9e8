"""Everything that the simulated laser meets: walls or ground, people, and objects fixed to the robot."""

import numpy as np
from numpy.typing import NDArray

from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.simulation import laser_sensor
from racecar.pipelines.simulation.driver import TICK, CarMotion
from racecar.pipelines.simulation.driving_lattice import DrivingLattice
from racecar.pipelines.simulation.ground import Ground, draw_heights
from racecar.pipelines.simulation.laser_models import LASERS, LaserModel
from racecar.pipelines.simulation.simulator_config import SimulationConfig
from racecar.pipelines.simulation.walkers import LEG_RADIUS, Follower, Walkers
from racecar.pipelines.simulation.wheel_odometry import is_carried

_POST_RADIUS = 0.015
_NEAREST_POST, _FARTHEST_POST = 0.18, 0.35
"""Metres, as for the posts of a robot with a plate above its laser."""
_BODY, _BODY_BULGE = 0.25, 0.05
"""Metres to a carrier's body, more or less, as in a recording of a carried robot: 0.2 to 0.3 m."""
_BODY_PERIOD = 1.1
"""Seconds of a carrier's two steps, in which the body sways."""


class Surroundings:
    """The car's surroundings during a drive; sweeps must be requested in time order."""

    def __init__(
        self, grid: OccupancyGrid, lattice: DrivingLattice, drive: CarMotion, config: SimulationConfig
    ) -> None:
        self._grid, self._drive, self._config = grid, drive, config
        self._laser = LASERS[config.laser]
        self._walkers = Walkers(config.walkers, lattice, self._generator(3))
        self._legs, self._legs_tick = self._walkers.walk(0.0), 0
        self._follower = Follower(drive, self._generator(6)) if config.follower else None
        self._posts = see_posts(config.posts, self._laser, self._generator(7))
        self._ground: Ground | None = None
        if config.tilt != 0.0 or config.hills > 0.0 or config.kerbs > 0.0:
            generator = self._generator(5)
            heights = draw_heights(grid, config.hills, config.kerbs, generator)
            self._ground = Ground(grid, heights, generator)

    def see(self, tick: int) -> NDArray[np.float64]:
        """(beams,) true ranges of the sweep that starts at a tick; inf without anything in reach."""
        laser, config = self._laser, self._config
        map_from_base = laser_sensor.poses_at_beams(self._drive, tick, laser)
        if self._ground is None:
            ranges = laser_sensor.see_walls(self._grid, map_from_base, laser)
        else:
            ranges = self._ground.cast(map_from_base, laser, config.tilt)
        laser_sensor.see_legs(ranges, map_from_base, laser, self._walk(tick), LEG_RADIUS)
        if self._follower is not None:
            steps = self._follower.legs_at(tick), self._follower.legs_at(tick + laser.period_ticks)
            laser_sensor.see_legs(ranges, map_from_base, laser, steps, LEG_RADIUS)
        ranges = np.minimum(ranges, self._posts)
        if config.carrier and is_carried(tick * TICK, config.carried):
            ranges = np.minimum(ranges, see_carrier(laser, tick * TICK))
        return ranges

    def _walk(self, tick: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(2 * walkers, 2) the walkers' legs at a tick, and one sweep later."""
        if tick > self._legs_tick:
            self._legs = self._walkers.walk((tick - self._legs_tick) * TICK)
        before = self._legs
        self._legs = self._walkers.walk(self._laser.scan_time)
        self._legs_tick = tick + self._laser.period_ticks
        return before, self._legs

    def _generator(self, part: int) -> np.random.Generator:
        return np.random.default_rng([self._config.seed, part])


def see_posts(number: int, laser: LaserModel, generator: np.random.Generator) -> NDArray[np.float64]:
    """(beams,) metres to the robot's own posts, each in a separate part of the view; inf between them."""
    part = np.radians(laser.field_of_view) / max(number, 1)
    ranges = np.full(laser.beams, np.inf)
    for post in range(number):
        bearing = laser.angle_min + part * (post + generator.uniform(0.1, 0.9))
        distance = generator.uniform(_NEAREST_POST, _FARTHEST_POST)
        center = distance * np.array([np.cos(bearing), np.sin(bearing)])
        seen = laser_sensor.range_to_disc(np.zeros((1, 3)), laser.bearings, center, _POST_RADIUS)
        ranges = np.minimum(ranges, seen)
    return ranges


def see_carrier(laser: LaserModel, seconds: float) -> NDArray[np.float64]:
    """(beams,) metres to the body of the robot's carrier, on the rear half of the beams; inf elsewhere."""
    sway = 2.0 * np.pi * seconds / _BODY_PERIOD
    body = _BODY + _BODY_BULGE * np.sin(3.0 * laser.bearings + 0.5 * np.sin(sway))
    is_ahead = np.abs(laser.bearings) < np.radians(laser.field_of_view) / 4
    return np.where(is_ahead, np.inf, body)
