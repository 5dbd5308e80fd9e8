"""Compile the localizer's kernels, or load them from numba's cache, before the first scan arrives."""

import numpy as np
from numpy.typing import NDArray

from racecar.localization.config import LocalizationConfig
from racecar.localization.filter.particle_filter import ParticleFilter
from racecar.localization.floor.walls import Walls
from racecar.localization.localizer import Localizer
from racecar.localization.odometry.motion_source import MotionSource
from racecar.localization.refinement.refinement import refine
from racecar.localization.sensor.end_points import select_points
from racecar.maps.geometry.se2 import IDENTITY
from racecar.maps.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from racecar.maps.grid.ray_casting import cast_rays
from racecar.sensors.odometry import Odometry
from racecar.sensors.scan import Scan

_STEPS, _SCATTER_AT = 20, 10
"""Scans in all, and before the map is searched; more than needed, since first calls compile kernels."""
_START = np.array([2.0, 3.0, 0.0])
"""Metres and radians, where `_room` is open, so that the drive stays in it."""
_BEARINGS = np.linspace(-2.3, 2.3, 1081)
"""Radians of a common sensor; any would do, since kernels are compiled for types, not sizes."""
_PERIOD = 25_000_000
"""Nanoseconds of a common sensor; any would do because nothing depends on it."""


def warm_up(config: LocalizationConfig) -> None:
    """Track a car through a room and relocalize it, so that the first scan is as fast as later ones."""
    room = _room()
    localizer = Localizer(room, config, np.random.default_rng(0))
    localizer.set_pose(_START)
    for step in range(_STEPS):
        if step == _SCATTER_AT:
            localizer.scatter()
        odometry = _odometry(step)
        localizer.add_odometry(odometry)
        ranges = cast_rays(room, _START + odometry.odom_from_base, _BEARINGS, 30.0)
        localizer.add_scan(_scan(odometry.stamp, ranges))
        localizer.pose_at(odometry.stamp)


def warm_up_filter(config: LocalizationConfig) -> None:
    """Compile kernels that need no map, which a second process can do while the first analyzes it.

    With nothing compiled yet, that nearly halved the start on a quiet machine of two cores: 21.6 s to 11.5 s.
    """
    motion = MotionSource(config)
    particles = ParticleFilter(_START[None], np.random.default_rng(0))
    for step in range(_STEPS):
        odometry = _odometry(step)
        motion.samples.add_odometry(odometry)
        particles.predict(motion.step_to(odometry.stamp), config.slip)
        mean, covariance, _ = particles.moments()
    scan = _scan(odometry.stamp, np.ones(len(_BEARINGS)))
    points = select_points(scan, config.beams, motion.poses_in_sweep)
    refine(mean, covariance, points, Walls(_room()), surface=0.0)


def _room() -> OccupancyGrid:
    cells = np.full((160, 240), OCCUPIED, dtype=np.int8)
    cells[1:-1, 1:-1] = FREE
    cells[60:90, 150:180] = OCCUPIED
    return OccupancyGrid(cells, 0.05, IDENTITY)


def _odometry(step: int) -> Odometry:
    return Odometry(step * _PERIOD, np.array([0.05 * step, 0.0, 0.0]), np.array([2.0, 0.0, 0.0]))


def _scan(stamp: int, ranges: NDArray[np.float64]) -> Scan:
    return Scan(stamp, _BEARINGS, ranges, np.linspace(0.0, 0.02, len(_BEARINGS)), IDENTITY, 30.0)
