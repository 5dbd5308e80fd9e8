"""The simulated drives on which the localizer is measured: each kind by map, seed and length."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import TypeAlias

import numpy as np

from benchmarks.accuracy.crowd import among_people
from benchmarks.accuracy.furniture import move_furniture
from benchmarks.accuracy.kidnapping import BETWEEN_SCANS, join_as_kidnappings
from racecar.maps.grid.distance_field import distance_to_occupied
from racecar.maps.grid.occupancy_grid import FREE, OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.maps.shipped import shipped_map
from racecar.pipelines.simulation.simulated_drive import SimulatedDrive, simulate_drive
from racecar.pipelines.simulation.simulator_config import NoiseLevel, SimulationConfig

Simulate: TypeAlias = Callable[[OccupancyGrid, int, float], SimulatedDrive]
"""A drive through a world, by its seed and its seconds."""

MAPS = "building", "track"
"""The shipped maps that are driven on; the others show what a mapper has to cope with."""
_TRACKING_SPEED, _RACING_SPEED, _RACING_SLIP = 3.0, 7.0, 0.25
"""m/s, m/s and a share."""
BETWEEN_KIDNAPPINGS = 6.0
"""Seconds; twice the time in which the car has to be found again."""
FAR = 2.0
"""Minimum metres that a kidnapped car is carried."""
_CROWD = 0.15
"""Share of the beams that people block."""
_TRIES = 20
"""Attempts per part of a drive with kidnappings, since some next starts are too near."""
_PLACES_SECONDS = 600.0
"""Chosen by judgement: long enough to pass most places of the shipped maps."""
_ROOM = 0.5
"""Metres of free floor around the start pose of a drive."""


@cache
def grid_of(map_name: str) -> OccupancyGrid:
    """A shipped map; always the same object, so that data derived from it is computed once."""
    return load_map(shipped_map(map_name))


def tracking_drive(
    grid: OccupancyGrid, seed: int, seconds: float, noise: NoiseLevel, **settings: object
) -> SimulatedDrive:
    """At up to 3 m/s, with other settings of `SimulationConfig`."""
    speed = {"max_speed": _TRACKING_SPEED, **settings}
    return _drive(grid, np.random.default_rng([seed, 5]), seed=seed, duration=seconds, noise=noise, **speed)


def racing_drive(grid: OccupancyGrid, seed: int, seconds: float) -> SimulatedDrive:
    """At up to 7 m/s, with slipping wheels."""
    return tracking_drive(grid, seed, seconds, NoiseLevel.SLIGHT, max_speed=_RACING_SPEED, slip=_RACING_SLIP)


def changed_map_drive(grid: OccupancyGrid, seed: int, seconds: float) -> SimulatedDrive:
    """Furniture has moved since the map was made, and people stand around."""
    rng = np.random.default_rng([seed, 11])
    world = move_furniture(grid, rng)
    slight = NoiseLevel.SLIGHT
    drive = _drive(world, rng, seed=seed, duration=seconds, noise=slight, max_speed=_TRACKING_SPEED)
    people = np.random.default_rng([seed, 7])
    return replace(drive, messages=list(among_people(drive.messages, _CROWD, people)))


def long_drive(grid: OccupancyGrid, seed: int, seconds: float) -> SimulatedDrive:
    """A long drive to count false alarms."""
    slight = NoiseLevel.SLIGHT
    settings = SimulationConfig(noise=slight, seed=99 + seed, max_speed=_TRACKING_SPEED, duration=seconds)
    return simulate_drive(grid, settings)


def places_drive(grid: OccupancyGrid) -> SimulatedDrive:
    """The drive from which the places to find are drawn."""
    slight = NoiseLevel.SLIGHT
    settings = SimulationConfig(noise=slight, max_speed=_TRACKING_SPEED, duration=_PLACES_SECONDS)
    return simulate_drive(grid, settings)


def kidnapped_drive(
    grid: OccupancyGrid, seed: int, seconds: float, pause: int = BETWEEN_SCANS
) -> SimulatedDrive:
    """Carried elsewhere every 6 seconds, at least once, with a pause (nanoseconds) in all messages."""
    parts = max(2, round(seconds / BETWEEN_KIDNAPPINGS))
    seeds = np.random.default_rng([seed, 13]).integers(2**31, size=_TRIES * parts).tolist()
    drives: list[SimulatedDrive] = []
    for own_seed in seeds:
        drive = tracking_drive(grid, own_seed, seconds / parts, NoiseLevel.SLIGHT)
        if not drives or _distance(drives[-1], drive) >= FAR:
            drives.append(drive)
        if len(drives) == parts:
            break
    return join_as_kidnappings(drives, pause)[0]


def _distance(drive: SimulatedDrive, following: SimulatedDrive) -> float:
    """Metres from the end of one drive to the start of the next."""
    return float(np.hypot(*(following.truth.map_from_base[0] - drive.truth.map_from_base[-1])[:2]))


def _drive(grid: OccupancyGrid, rng: np.random.Generator, **settings: object) -> SimulatedDrive:
    return simulate_drive(grid, SimulationConfig(start=_random_start(grid, rng), **settings))


def _random_start(grid: OccupancyGrid, rng: np.random.Generator) -> tuple[float, float, float]:
    """A pose with room around it."""
    is_roomy = (grid.cells == FREE) & (distance_to_occupied(grid) > _ROOM)
    x, y = grid.center_of(rng.choice(np.argwhere(is_roomy), size=1))[0]
    return float(x), float(y), float(rng.uniform(-np.pi, np.pi))
