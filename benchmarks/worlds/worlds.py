"""Simulated worlds, each with a fault that recordings have, mapped as a user would."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path
from statistics import mean
from tempfile import TemporaryDirectory
from typing import Annotated, Any

import numpy as np
import typer

from benchmarks.harness.bench import Bench
from benchmarks.harness.inputs import chosen
from benchmarks.harness.table import Column
from benchmarks.worlds.drive_errors import DriveErrors, drive_errors
from racecar.mapping.config import MappingConfig
from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.map_files import load_map
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.commands.results import print_warnings
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.mapping_run import build_map
from racecar.pipelines.runs.run_context import RunContext
from racecar.pipelines.simulation.driver import TICK
from racecar.pipelines.simulation.simulator import START_NS, Simulation, write_bag
from racecar.pipelines.simulation.simulator_config import SimulationConfig


@dataclass(frozen=True)
class World:
    """Settings of `SimulationConfig` except the seed."""

    map: str
    settings: Mapping[str, Any] = field(default_factory=dict)


_INDOORS = {"duration": 150.0, "scan_every": 0.1}
"""About 270 m through the building's corridors and several rooms, with loops. Only ten of the race car's
scans a second are kept, as most robots have no more and the mapper needs no more."""
_SLOWLY = {"max_speed": 1.0}
"""m/s, the speed of robots with slow loggers: 1 to 3 m from scan to scan."""

WORLDS: Mapping[str, World] = {
    "plain": World("building", _INDOORS),
    "tilted": World("building", {**_INDOORS, "tilt": 2.0, "hills": 0.02}),
    "tilted short": World("building", {"laser": "short", "tilt": 4.0, "hills": 0.02}),
    "campus": World("campus", {"laser": "outdoor"}),
    "slope": World("campus", {"laser": "outdoor", "tilt": 0.5, "hills": 0.03, "kerbs": 0.15}),
    "posts": World("building", {**_INDOORS, "posts": 4}),
    "carried": World("building", {**_INDOORS, "carried": 10.0}),
    "carrier": World("building", {**_INDOORS, "carried": 10.0, "carrier": True}),
    "follower": World("building", {"laser": "round", "follower": True}),
    "one per 1 s": World("building", {**_SLOWLY, "scan_every": 1.0}),
    "one per 2 s": World("building", {**_SLOWLY, "scan_every": 2.0}),
    "one per 3 s": World("building", {**_SLOWLY, "scan_every": 3.0}),
    "gaps": World("building", {**_INDOORS, **_SLOWLY, "duration": 270.0, "scan_gaps": 3.0}),
    "short": World("building", {"laser": "short"}),
    "steering": World("building", {**_INDOORS, "steering": True}),
    "slow steering": World("building", {**_SLOWLY, "scan_every": 1.0, "steering": True}),
}


@dataclass(frozen=True)
class WorldDrive:
    """One drive through a world."""

    errors: DriveErrors
    wheels: DriveErrors
    """Errors of the odometry alone."""
    scans: int
    placed: int
    """Number of scans with a pose."""
    warnings: list[str]
    verdict: str | None
    """Verdict on the map's quality, if the report has one."""
    seconds: float
    """Wall time of the mapping."""


@dataclass(frozen=True)
class WorldFigures:
    """Means over the drives through a world, and the worst of them."""

    relation_m: Annotated[float, Column("relations (m)", ".3f")]
    worst_relation_m: Annotated[float, Column("worst drive (m)", ".3f")]
    relation_max_m: Annotated[float, Column("worst relation (m)", ".2f")]
    heading_deg: Annotated[float, Column("heading (°)", ".2f")]
    worst_heading_deg: Annotated[float, Column("worst (°)", ".2f")]
    far_share: Annotated[float, Column("farthest", ".2%")]
    wheels_m: Annotated[float, Column("wheels (m)", ".3f")]
    wheels_deg: Annotated[float, Column("wheels (°)", ".2f")]
    path_m: Annotated[float, Column("path (m)", ".0f")]
    placed: Annotated[str, Column("placed")]
    warnings: Annotated[list[int], Column("warnings")]
    verdicts: Annotated[list[str | None], Column("verdicts")]
    seconds: Annotated[float, Column("s", ".0f")]


def worlds(
    bench: Bench,
    world: Annotated[
        list[str] | None,
        typer.Option("--world", metavar="NAME", help="Only this one; may be repeated.", show_default=False),
    ] = None,
    seeds: Annotated[int, typer.Option("--seeds", min=1, metavar="N", help="Drives through each world.")] = 5,
) -> None:
    """Map simulated drives, each with a fault that recordings have, and compare with the truth.

    Example: python -m benchmarks worlds --seeds 2 --world slope --world 'one per 2 s'
    """
    by_seed = {f"seed {seed}": seed for seed in range(bench.seed, bench.seed + seeds)}
    map_world = partial(map_drive, settings=bench.settings.mapping)
    rows = bench.cross("worlds", chosen(WORLDS, world, "world").items(), by_seed, map_world)
    bench.table(
        "Errors against the truth, mean and worst over the drives",
        {name: world_figures(list(drives.values())) for name, drives in rows.items()},
        "relations: pairs of scans up to 10 m apart; heading: over 100 m of path; "
        "farthest: from the first pose, as a share of the path; wheels: what odometry alone has",
    )
    if not bench.quiet:
        print_warnings(
            f"{name}, {seed}: {sentence}"
            for name, drives in rows.items()
            for seed, drive in drives.items()
            for sentence in drive.warnings
        )


def world_figures(drives: Sequence[WorldDrive]) -> WorldFigures:
    """The figures of the drives through a world."""
    found = [drive.errors for drive in drives]
    relations, headings = [each.relation_m for each in found], [each.heading_deg for each in found]
    return WorldFigures(
        relation_m=mean(relations),
        worst_relation_m=max(relations),
        relation_max_m=max(each.relation_max_m for each in found),
        heading_deg=mean(headings),
        worst_heading_deg=max(headings),
        far_share=max(each.far_m / max(each.path_m, 1e-9) for each in found),
        wheels_m=mean(drive.wheels.relation_m for drive in drives),
        wheels_deg=mean(drive.wheels.heading_deg for drive in drives),
        path_m=mean(each.path_m for each in found),
        placed=f"{sum(drive.placed for drive in drives)}/{sum(drive.scans for drive in drives)}",
        warnings=[len(drive.warnings) for drive in drives],
        verdicts=[drive.verdict for drive in drives],
        seconds=mean(drive.seconds for drive in drives),
    )


def map_drive(world: World, seed: int, settings: MappingConfig) -> WorldDrive:
    """Drive through a world and map the bag."""
    simulation = Simulation(_plan(world.map), SimulationConfig(**world.settings, seed=seed))
    report = Report("python -m benchmarks worlds")
    with TemporaryDirectory() as folder:
        bag = Path(folder) / "drive.bag"
        write_bag(simulation, bag, lambda share: None)
        with BagReader(bag) as reader:
            trajectory = build_map(reader, Config(mapping=settings), RunContext(report)).trajectory
    told = report.as_dict()
    true = _truth_at(simulation, trajectory)
    return WorldDrive(
        errors=drive_errors(trajectory.map_from_base, true, np.random.default_rng(0)),
        wheels=drive_errors(_wheels_at(simulation, trajectory), true, np.random.default_rng(0)),
        scans=len(simulation.ground_truth),
        placed=len(trajectory),
        warnings=told["warnings"],
        verdict=told.get("quality", {}).get("verdict"),
        seconds=float(told["stages"]["total"]["wall_seconds"]),
    )


@cache
def _plan(name: str) -> OccupancyGrid:
    """Always the same object, so that the path through it is planned once."""
    return load_map(Path(name))


def _wheels_at(simulation: Simulation, trajectory: Trajectory) -> Pose:
    """(N, 3) poses from odometry alone at a trajectory's stamps."""
    samples = simulation.odometry()
    stamps = np.array([sample.stamp for sample in samples])
    return Trajectory(stamps, np.array([sample.odom_from_base for sample in samples])).poses_at(
        trajectory.stamps
    )


def _truth_at(simulation: Simulation, trajectory: Trajectory) -> Pose:
    """(N, 3) true poses at a trajectory's stamps, which a clock correction may have shifted."""
    poses = simulation.drive.map_from_base
    stamps = START_NS + np.arange(len(poses)) * round(TICK * 1e9)
    return Trajectory(stamps, poses).poses_at(trajectory.stamps)
