"""The simulated LiDAR, which rotates while the car moves."""

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, compose, interpolate, inverse, transform_points
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.ray_casting import cast_rays
from racecar.pipelines.simulation.driver import TICK, CarMotion
from racecar.pipelines.simulation.laser_models import BASE_FROM_LASER, LaserModel

_ALL_ROUND = 300.0
"""Degrees; a laser with a wider view may see a disc with both its first and its last beams."""
_FADING = 4
"""Power of the distance by which echoes fade. Chosen by judgement: 6 % are lost at half of the faint range,
94 % at double of it."""


def scan_ticks(drive: CarMotion, laser: LaserModel) -> NDArray[np.int64]:
    """(S,) ticks of the first beams of all sweeps that end before the drive does."""
    last = len(drive.speed) - 1 - int(np.ceil(laser.time_offsets[-1] / TICK))
    return np.arange(0, last + 1, laser.period_ticks, dtype=np.int64)


def poses_at_beams(drive: CarMotion, tick: int, laser: LaserModel) -> Pose:
    """(beams, 3) ``map_from_base`` at the time of each beam of the sweep that starts at a tick."""
    ticks = laser.time_offsets / TICK
    before = np.minimum(ticks.astype(np.int64), len(drive.speed) - 2)
    return interpolate(
        drive.map_from_base[tick + before], drive.map_from_base[tick + before + 1], ticks - before
    )


def see_walls(grid: OccupancyGrid, map_from_base: Pose, laser: LaserModel) -> NDArray[np.float64]:
    """(beams,) true ranges from base poses (beams, 3) in a plane; inf without a wall in reach."""
    return cast_rays(grid, compose(map_from_base, BASE_FROM_LASER), laser.bearings, laser.range_max)


def see_legs(
    ranges: NDArray[np.float64],
    map_from_base: Pose,
    laser: LaserModel,
    legs: tuple[NDArray[np.float64], NDArray[np.float64]],
    leg_radius: float,
) -> None:
    """Shorten the ranges (beams,) of beams that meet legs.

    ``legs`` (M, 2) are their centres at the start of the sweep and ``scan_time`` later.
    """
    map_from_laser = compose(map_from_base, BASE_FROM_LASER)
    for leg_before, leg_after in zip(*legs, strict=True):
        beams = _beams_towards(map_from_laser[laser.beams // 2], laser, leg_before, leg_radius)
        moved = (laser.time_offsets[beams] / laser.scan_time)[:, None] * (leg_after - leg_before)
        bearings = laser.bearings[beams]
        to_leg = range_to_disc(map_from_laser[beams], bearings, leg_before + moved, leg_radius)
        ranges[beams] = np.minimum(ranges[beams], to_leg)


def measure(
    ranges: NDArray[np.float64],
    laser: LaserModel,
    noise: float,
    dropouts: float,
    generator: np.random.Generator,
) -> NDArray[np.float32]:
    """(beams,) measured from true ranges: with noise, and with some returns missing (inf)."""
    measured = ranges + noise * generator.standard_normal(len(ranges))
    is_empty = (generator.random(len(ranges)) < dropouts) | (measured > laser.range_max)
    if np.isfinite(laser.faint_range):
        is_empty |= generator.random(len(ranges)) > 1.0 / (1.0 + (ranges / laser.faint_range) ** _FADING)
    return np.where(is_empty, np.inf, np.maximum(measured, 0.0)).astype(np.float32)


def _beams_towards(
    map_from_laser: Pose, laser: LaserModel, center: NDArray[np.float64], radius: float
) -> slice:
    """The beams that may meet a disc, with a margin for the motion of car and disc in a sweep."""
    x, y = transform_points(inverse(map_from_laser), center[None])[0]
    distance = np.hypot(x, y)
    if distance < 1.0 or laser.field_of_view > _ALL_ROUND:
        return slice(0, laser.beams)
    spread = np.arcsin(min(1.0, (radius + 0.3) / distance)) + 0.15
    first, last = np.searchsorted(laser.bearings, np.arctan2(y, x) + np.array([-spread, spread]))
    return slice(int(first), int(last))


def range_to_disc(
    map_from_laser: Pose, bearings: NDArray[np.float64], center: NDArray[np.float64], radius: float
) -> NDArray[np.float64]:
    """(N,) metres along bearings (N,) from poses (N, 3) to a disc at center (N, 2).

    It is inf for a beam that misses the disc or starts inside it.
    """
    heading = map_from_laser[:, 2] + bearings
    x, y = (center - map_from_laser[:, :2]).T
    cos, sin = np.cos(heading), np.sin(heading)
    along, aside = x * cos + y * sin, y * cos - x * sin
    into = radius**2 - aside**2
    entry = along - np.sqrt(np.maximum(into, 0.0))
    return np.where((into > 0.0) & (entry > 0.0), entry, np.inf)
