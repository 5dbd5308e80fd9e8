"""All stages on simulated data: drive, bag, map, localize on that map, measure both against the truth."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from racecar.localization.localizer import Localizer
from racecar.maps.geometry.se2 import Pose, compose, inverse
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.files.report import Report
from racecar.pipelines.files.tum import save_tum
from racecar.pipelines.runs.evaluation.evaluation import TrajectoryErrors, compare
from racecar.pipelines.runs.localization_run import run_localization, save_localization
from racecar.pipelines.runs.mapping_run import build_map, save_mapping
from racecar.pipelines.runs.progress import progress_bar
from racecar.pipelines.simulation.simulator import Simulation, ground_truth_file, write_bag
from racecar.pipelines.simulation.simulator_config import SimulationConfig


@dataclass(frozen=True, eq=False)
class DemoErrors:
    """How far both stages are from the truth."""

    mapping: TrajectoryErrors
    """After alignment of the map with the world."""
    localization: TrajectoryErrors
    """In the built map, with the same alignment."""


def run_demo(
    world: OccupancyGrid,
    folder: Path,
    report: Report,
    *,
    seed: int,
    mapping_seconds: float | None = None,
    localization_seconds: float = 60.0,
    announce: Callable[[str], None],
    quiet: bool,
) -> DemoErrors:
    """Run every stage and write its files into an existing folder.

    The mapping drive covers the whole world unless its duration is given; the second drive starts where the
    first was halfway.
    """
    with report.stage("first drive"):
        announce("A simulated car drives through the world and records a bag.")
        settings = SimulationConfig(seed=seed, duration=mapping_seconds)
        truth = _drive(world, settings, folder / "mapping_drive", quiet=quiet)
    with report.stage("mapping"):
        announce("The bag becomes a map.")
        mapping = _map(folder, truth, quiet=quiet)
    with report.stage("second drive"):
        announce("The car drives again, from another place.")
        halfway = truth.map_from_base[len(truth) // 2]
        start = (float(halfway[0]), float(halfway[1]), float(halfway[2]))
        settings = SimulationConfig(seed=seed + 1, duration=localization_seconds, start=start)
        second_truth = _drive(world, settings, folder / "second_drive", quiet=quiet)
    with report.stage("localization"):
        announce("The particle filter finds the car on the map that was just built.")
        localization = _localize(folder, second_truth, mapping.reference_from_map, seed, quiet=quiet)
    report.add("accuracy", {"mapping": mapping.summary(), "localization": localization.summary()})
    return DemoErrors(mapping, localization)


def _drive(world: OccupancyGrid, settings: SimulationConfig, path: Path, *, quiet: bool) -> Trajectory:
    simulation, bag = Simulation(world, settings), path.with_suffix(".bag")
    with progress_bar("Simulating", quiet=quiet) as advance_to:
        write_bag(simulation, bag, advance_to)
    save_tum(simulation.ground_truth, ground_truth_file(bag))
    return simulation.ground_truth


def _map(folder: Path, truth: Trajectory, *, quiet: bool) -> TrajectoryErrors:
    bag, report = folder / "mapping_drive.bag", Report("racecar map")
    report.add("inputs", {"bag": bag.name})
    with BagReader(bag) as reader:
        result = build_map(reader, Config().mapping, report, quiet=quiet)
    errors = compare(result.trajectory, truth)
    report.add("accuracy", {"against_ground_truth": errors.summary()})
    (folder / "map").mkdir()
    save_mapping(result, report, folder / "map", title=bag.name)
    return errors


def _localize(
    folder: Path, truth: Trajectory, world_from_map: Pose, seed: int, *, quiet: bool
) -> TrajectoryErrors:
    bag, report = folder / "second_drive.bag", Report("racecar localize")
    grid, settings = load_map(folder / "map"), Config().localization
    localizer = Localizer(grid, settings, np.random.default_rng(seed))
    start = compose(inverse(world_from_map), truth.map_from_base[0])
    localizer.set_pose(start)
    report.add("inputs", {"bag": bag.name, "map": "map", "seed": seed, "start": start})
    with BagReader(bag) as reader:
        run = run_localization(reader, localizer, grid, report, quiet=quiet)
    errors = compare(run.trajectory, truth, reference_from_map=world_from_map)
    report.add("accuracy", {"against_ground_truth": errors.summary()})
    (folder / "localized").mkdir()
    save_localization(run, grid, None, report, folder / "localized", title=bag.name)
    return errors
