"""All stages on simulated data: drive, bag, map, localize on that map, measure both against the truth."""

from dataclasses import dataclass
from pathlib import Path

from racecar.maps.geometry.se2 import Pose, compose, inverse
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.files.report import Report
from racecar.pipelines.files.tum import save_tum
from racecar.pipelines.runs.evaluation.evaluation import TrajectoryErrors, compare
from racecar.pipelines.runs.localization_run import run_localization
from racecar.pipelines.runs.mapping_run import build_map
from racecar.pipelines.runs.run_context import RunContext
from racecar.pipelines.simulation.simulator import Simulation, ground_truth_file, write_bag
from racecar.pipelines.simulation.simulator_config import SimulationConfig


@dataclass(frozen=True, eq=False)
class DemoErrors:
    """Errors of both stages against the truth."""

    mapping: TrajectoryErrors
    """After aligning the map with the world."""
    localization: TrajectoryErrors
    """In the built map, with the same alignment."""


def run_demo(
    world: OccupancyGrid,
    folder: Path,
    context: RunContext,
    *,
    seed: int,
    mapping_seconds: float | None = None,
    localization_seconds: float = 60.0,
) -> DemoErrors:
    """Run every stage and write its files into an existing folder.

    The mapping drive covers the whole world unless its duration is given; the second drive starts halfway
    along the first.
    """
    report, announce = context.report, context.announce
    with report.stage("first drive"):
        announce("A simulated car drives through the world and records a bag.")
        settings = SimulationConfig(seed=seed, duration=mapping_seconds)
        truth = _drive(world, settings, folder / "mapping_drive.bag", context)
    with report.stage("mapping"):
        announce("The bag becomes a map.")
        mapping = _map(folder, truth, context)
    with report.stage("second drive"):
        announce("The car drives again, from another place.")
        halfway = truth.map_from_base[len(truth) // 2]
        start = (float(halfway[0]), float(halfway[1]), float(halfway[2]))
        settings = SimulationConfig(seed=seed + 1, duration=localization_seconds, start=start)
        second_truth = _drive(world, settings, folder / "second_drive.bag", context)
    with report.stage("localization"):
        announce("The particle filter finds the car on the map that was just built.")
        localization = _localize(folder, second_truth, mapping.reference_from_map, seed, context)
    report.add("accuracy", {"mapping": mapping.summary(), "localization": localization.summary()})
    return DemoErrors(mapping, localization)


def _drive(world: OccupancyGrid, settings: SimulationConfig, bag: Path, context: RunContext) -> Trajectory:
    simulation = Simulation(world, settings)
    with context.progress("Simulating") as advance_to:
        write_bag(simulation, bag, advance_to)
    save_tum(simulation.ground_truth, ground_truth_file(bag))
    return simulation.ground_truth


def _map(folder: Path, truth: Trajectory, context: RunContext) -> TrajectoryErrors:
    report = Report("racecar map")
    with BagReader(folder / "mapping_drive.bag") as reader:
        report.add("inputs", {"bag": reader.path.name})
        run = build_map(reader, Config(), RunContext(report, quiet=context.quiet))
    errors = compare(run.trajectory, truth)
    report.add("accuracy", {"against_ground_truth": errors.summary()})
    run.save(folder / "map")
    return errors


def _localize(
    folder: Path, truth: Trajectory, world_from_map: Pose, seed: int, context: RunContext
) -> TrajectoryErrors:
    report = Report("racecar localize")
    start = compose(inverse(world_from_map), truth.map_from_base[0])
    with BagReader(folder / "second_drive.bag") as reader:
        report.add("inputs", {"bag": reader.path.name, "map": "map", "start": start})
        grid, own = load_map(folder / "map"), RunContext(report, quiet=context.quiet)
        run = run_localization(reader, grid, Config(), own, initial_pose=start, seed=seed)
    errors = compare(run.trajectory, truth, reference_from_map=world_from_map)
    report.add("accuracy", {"against_ground_truth": errors.summary()})
    run.save(folder / "localized")
    return errors
