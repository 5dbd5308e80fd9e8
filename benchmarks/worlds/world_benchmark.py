"""Worlds driven through and mapped as a user maps a bag."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks.worlds.drive_errors import DriveErrors, drive_errors
from benchmarks.worlds.worlds import World
from racecar.mapping.config import MappingConfig
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.calibration_run import calibrate
from racecar.pipelines.runs.mapping_run import build_map
from racecar.pipelines.runs.other_process import in_fresh_process
from racecar.pipelines.simulation.driver import TICK
from racecar.pipelines.simulation.plans.catalogue import load_or_draw
from racecar.pipelines.simulation.simulator import START_NS, Simulation, write_bag
from racecar.pipelines.simulation.simulator_config import SimulationConfig


@dataclass(frozen=True)
class WorldFigures:
    """One drive through a world."""

    seed: int
    errors: DriveErrors
    wheels: DriveErrors
    """Of the odometry alone."""
    scans: int
    placed: int
    """Scans with a pose."""
    warnings: tuple[str, ...]
    verdict: str | None
    """Of the map's quality, where the report has one."""
    seconds: float
    """Wall time of the mapping."""

    def as_dict(self) -> dict[str, Any]:
        """For a JSON file."""
        return asdict(self)


def measure_world(
    world: World, seeds: Sequence[int], settings: MappingConfig, *, quiet: bool
) -> list[WorldFigures]:
    """Drive and map a world once for each seed, in a fresh process."""
    return in_fresh_process(partial(_drive_and_map, world, seeds, settings, quiet=quiet))


def _drive_and_map(
    world: World, seeds: Sequence[int], settings: MappingConfig, *, quiet: bool
) -> list[WorldFigures]:
    grid = load_or_draw(Path(world.map))  # one object, so that the way through it is planned once
    return [_measure(grid, world, seed, settings, quiet=quiet) for seed in seeds]


def _measure(
    grid: OccupancyGrid, world: World, seed: int, settings: MappingConfig, *, quiet: bool
) -> WorldFigures:
    simulation = Simulation(grid, SimulationConfig(**world.settings, seed=seed))
    report = Report("python -m benchmarks worlds")
    with TemporaryDirectory() as folder:
        bag = Path(folder) / "drive.bag"
        write_bag(simulation, bag, lambda share: None)
        with BagReader(bag) as reader:
            calibrate(reader, quiet=quiet)
            trajectory = build_map(reader, settings, report, quiet=quiet).trajectory
    told = report.as_dict()
    true = _truth_at(simulation, trajectory)
    return WorldFigures(
        seed=seed,
        errors=drive_errors(trajectory.map_from_base, true, np.random.default_rng(0)),
        wheels=drive_errors(_wheels_at(simulation, trajectory), true, np.random.default_rng(0)),
        scans=len(simulation.ground_truth),
        placed=len(trajectory),
        warnings=tuple(told["warnings"]),
        verdict=told.get("quality", {}).get("verdict"),
        seconds=float(told["stages"]["total"]["wall_seconds"]),
    )


def _wheels_at(simulation: Simulation, trajectory: Trajectory) -> Pose:
    """(N, 3) what the odometry alone says at a trajectory's stamps."""
    samples = simulation.odometry()
    stamps = np.array([sample.stamp for sample in samples])
    return Trajectory(stamps, np.array([sample.odom_from_base for sample in samples])).poses_at(
        trajectory.stamps
    )


def _truth_at(simulation: Simulation, trajectory: Trajectory) -> Pose:
    """(N, 3) the true poses at a trajectory's stamps, which a correction of clocks may have shifted."""
    poses = simulation.drive.map_from_base
    stamps = START_NS + np.arange(len(poses)) * round(TICK * 1e9)
    return Trajectory(stamps, poses).poses_at(trajectory.stamps)
