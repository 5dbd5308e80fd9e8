"""The simulated LiDAR: a Hokuyo UST-10LX that turns while the car moves."""

import numpy as np
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose, compose, interpolate, inverse, transform_points
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.grid.ray_casting import cast_rays
from racecar.pipelines.simulation.driver import TICK, CarMotion

BEAMS = 1081
"""By the sensor's data sheet, as are the 270° that it sees, 40 scans a second and ranges of 0.06 to 30 m."""
ANGLE_MIN = float(np.radians(-135.0))
ANGLE_INCREMENT = float(np.radians(270.0)) / (BEAMS - 1)
SCAN_TIME = 0.025
TIME_INCREMENT = SCAN_TIME * 0.75 / (BEAMS - 1)
"""Seconds: the mirror sees 270° during three quarters of its turn."""
RANGE_MIN, RANGE_MAX = 0.06, 30.0
BASE_FROM_LASER = np.array([0.27, 0.0, 0.0])
"""(3,) on the axis, above the front wheels."""

PERIOD_TICKS = round(SCAN_TIME / TICK)
BEARINGS: NDArray[np.float64] = ANGLE_MIN + ANGLE_INCREMENT * np.arange(BEAMS, dtype=np.float64)
TIME_OFFSETS: NDArray[np.float64] = TIME_INCREMENT * np.arange(BEAMS, dtype=np.float64)
_BEAM_TICKS: NDArray[np.float64] = TIME_OFFSETS / TICK


def scan_ticks(drive: CarMotion) -> NDArray[np.int64]:
    """(S,) the tick of each sweep's first beam, for all sweeps that end before the drive does."""
    last = len(drive.speed) - 1 - int(np.ceil(_BEAM_TICKS[-1]))
    return np.arange(0, last + 1, PERIOD_TICKS, dtype=np.int64)


def sweep(
    grid: OccupancyGrid,
    drive: CarMotion,
    tick: int,
    legs: tuple[NDArray[np.float64], NDArray[np.float64]],
    leg_radius: float,
) -> NDArray[np.float64]:
    """(BEAMS,) true ranges, each beam from where the laser is at its own time; inf where nothing is in reach.

    ``legs`` (M, 2) are the centres of legs at the sweep's beginning and ``SCAN_TIME`` later.
    """
    before = np.minimum(_BEAM_TICKS.astype(np.int64), len(drive.speed) - 2)
    map_from_base = interpolate(
        drive.map_from_base[tick + before], drive.map_from_base[tick + before + 1], _BEAM_TICKS - before
    )
    map_from_laser = compose(map_from_base, BASE_FROM_LASER)
    ranges = cast_rays(grid, map_from_laser, BEARINGS, RANGE_MAX)
    for leg_before, leg_after in zip(*legs, strict=True):
        beams = _beams_towards(map_from_laser[BEAMS // 2], leg_before, leg_radius)
        moved = (TIME_OFFSETS[beams] / SCAN_TIME)[:, None] * (leg_after - leg_before)
        to_leg = _range_to_disc(map_from_laser[beams], BEARINGS[beams], leg_before + moved, leg_radius)
        ranges[beams] = np.minimum(ranges[beams], to_leg)
    return ranges


def measure(
    ranges: NDArray[np.float64], noise: float, dropouts: float, generator: np.random.Generator
) -> NDArray[np.float32]:
    """(BEAMS,) what the sensor reports of true ranges: noisy, and here and there nothing (inf)."""
    measured = ranges + noise * generator.standard_normal(len(ranges))
    is_empty = (generator.random(len(ranges)) < dropouts) | (measured > RANGE_MAX)
    return np.where(is_empty, np.inf, np.maximum(measured, 0.0)).astype(np.float32)


def _beams_towards(map_from_laser: Pose, center: NDArray[np.float64], radius: float) -> slice:
    """The beams that may meet a disc, with room for what car and disc move in a sweep."""
    x, y = transform_points(inverse(map_from_laser), center[None])[0]
    distance = np.hypot(x, y)
    if distance < 1.0:
        return slice(0, BEAMS)
    spread = np.arcsin(min(1.0, (radius + 0.3) / distance)) + 0.15
    first, last = np.searchsorted(BEARINGS, np.arctan2(y, x) + np.array([-spread, spread]))
    return slice(int(first), int(last))


def _range_to_disc(
    map_from_laser: Pose, bearings: NDArray[np.float64], center: NDArray[np.float64], radius: float
) -> NDArray[np.float64]:
    """(N,) metres along bearings (N,) from poses (N, 3) to a disc at center (N, 2).

    It is inf for a beam that passes the disc or starts inside it.
    """
    heading = map_from_laser[:, 2] + bearings
    x, y = (center - map_from_laser[:, :2]).T
    cos, sin = np.cos(heading), np.sin(heading)
    along, aside = x * cos + y * sin, y * cos - x * sin
    into = radius**2 - aside**2
    entry = along - np.sqrt(np.maximum(into, 0.0))
    return np.where((into > 0.0) & (entry > 0.0), entry, np.inf)
