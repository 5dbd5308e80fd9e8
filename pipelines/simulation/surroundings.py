"""All that the laser of a simulated drive meets: walls or ground, people, and what moves along with it."""

import numpy as np
from numpy.typing import NDArray

from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.simulation import laser_sensor
from racecar.pipelines.simulation.driver import TICK, CarMotion
from racecar.pipelines.simulation.driving_lattice import DrivingLattice
from racecar.pipelines.simulation.ground import Ground, draw_heights
from racecar.pipelines.simulation.laser_models import LASERS
from racecar.pipelines.simulation.near_returns import see_carrier, see_posts
from racecar.pipelines.simulation.simulator_config import SimulationConfig
from racecar.pipelines.simulation.walkers import LEG_RADIUS, Follower, Walkers
from racecar.pipelines.simulation.wheel_odometry import is_carried


class Surroundings:
    """What is about the car as the drive goes on; sweeps are asked for in the order of time."""

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
        """(beams,) true ranges of the sweep that begins at a tick; inf where nothing is in reach."""
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
        """(2 * persons, 2) the walkers' legs at a tick, and a sweep's time later."""
        if tick > self._legs_tick:
            self._legs = self._walkers.walk((tick - self._legs_tick) * TICK)
        before = self._legs
        self._legs = self._walkers.walk(self._laser.scan_time)
        self._legs_tick = tick + self._laser.period_ticks
        return before, self._legs

    def _generator(self, part: int) -> np.random.Generator:
        return np.random.default_rng([self._config.seed, part])
