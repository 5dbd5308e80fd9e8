"""A building in which half of the furniture is moved every day, mapped day after day."""

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.accuracy.furniture import move_furniture
from racecar.mapping.config import MappingConfig
from racecar.mapping.mapper import Mapper
from racecar.mapping.quality.map_quality import Verdict
from racecar.mapping.session.merging import EarlierMap
from racecar.mapping.session.session import Session
from racecar.mapping.state.result import MappingResult
from racecar.maps.geometry.se2 import Pose, compose, inverse, transform_points
from racecar.maps.grid.distance_field import distance_to_occupied
from racecar.maps.grid.occupancy_grid import OCCUPIED_FROM, OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.maps.shipped import shipped_map
from racecar.pipelines.bags.replay import feed
from racecar.pipelines.simulation.simulator import Simulation
from racecar.pipelines.simulation.simulator_config import LaserKind, NoiseLevel, SimulationConfig

DAYS, SECONDS = 8, 90.0
CLEAR = 0.12
"""Metres from what stands there today, within which a map may have it."""


@dataclass(frozen=True)
class Day:
    """The map of one day."""

    result: MappingResult
    worst: float
    """Metres that the path driven that day is off, in the frame of the first day."""
    still_occupied: float
    """Share of the floor that was cleared that day which the map has occupied."""


def drive(world: OccupancyGrid, seed: int, earlier: Session | None) -> tuple[MappingResult, Pose]:
    """A day's map, and the true poses of its scans."""
    config = SimulationConfig(seed=seed, duration=SECONDS, noise=NoiseLevel.FULL, laser=LaserKind.ROUND)
    simulation, settings = Simulation(world, config), MappingConfig()
    mapper = Mapper(settings)
    for message in simulation.messages():
        feed(message, mapper)
    found = None if earlier is None else EarlierMap(earlier)
    return mapper.finish(earlier=found), simulation.ground_truth.map_from_base


def occupied_in(grid: OccupancyGrid, points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(N,) whether a map has places (N, 2) occupied."""
    at = grid.cell_of(points)
    inside = np.all((at >= 0) & (at < grid.cells.shape), axis=1)
    is_occupied = np.zeros(len(points), dtype=np.bool_)
    is_occupied[inside] = grid.cells[tuple(at[inside].T)] >= OCCUPIED_FROM
    return is_occupied


@pytest.fixture(scope="module")
def days() -> list[Day]:
    world, earlier, world_from_map, found = load_map(shipped_map("building")), None, None, []
    for number in range(DAYS):
        before = world
        if number > 0:
            world = move_furniture(world, np.random.default_rng([number, 5]))
        result, true = drive(world, number, earlier)
        earlier = result.session
        if world_from_map is None:
            world_from_map = compose(true[0], inverse(result.trajectory.map_from_base[0]))
        path = compose(world_from_map, result.trajectory.map_from_base)[:, :2]
        is_cleared = (before.cells >= OCCUPIED_FROM) & (distance_to_occupied(world) > CLEAR)
        cleared = transform_points(inverse(world_from_map), world.center_of(np.argwhere(is_cleared)))
        share = float(np.mean(occupied_in(result.grid, cleared))) if len(cleared) else 0.0
        found.append(Day(result, float(np.hypot(*(path - true[:, :2]).T).max()), share))
    return found


@pytest.mark.slow
def test_the_map_stays_right(days: list[Day]) -> None:
    assert all(day.result.quality.verdict == Verdict.GOOD for day in days)
    assert max(day.worst for day in days) < 0.5  # from the heading of the first scan on
    assert max(day.still_occupied for day in days) < 0.1


@pytest.mark.slow
def test_it_grows_with_the_building_and_not_with_the_days(days: list[Day]) -> None:
    keyframes = [len(day.result.session.rays) for day in days]
    per_drive = [len(day.result.keyframe_indices) for day in days]
    grown = np.diff(keyframes)
    assert grown[-3:].mean() < 0.4 * np.mean(per_drive)
    ties = [len(day.result.session.constraints) / count for day, count in zip(days, keyframes, strict=True)]
    assert max(ties) < 1.5 * ties[1]
