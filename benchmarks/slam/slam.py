"""The logs of the SLAM benchmark, mapped as a user would and measured against their true relations."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from typing import Annotated, Any

import numpy as np
import typer

from benchmarks.harness.bench import Bench
from benchmarks.harness.inputs import DataOption, recordings_folder
from benchmarks.harness.table import Column, cells
from benchmarks.harness.variant import Variant
from benchmarks.slam.false_loops import FalseLoopFigures, with_false_loops
from benchmarks.slam.logs import BenchmarkLog, find_logs
from benchmarks.slam.parts import PARTS
from racecar.mapping.config import MappingConfig
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.commands.results import print_warnings
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.evaluation.relations import load_relations, relation_errors
from racecar.pipelines.runs.mapping_run import build_map
from racecar.pipelines.runs.run_context import RunContext


@dataclass(frozen=True, eq=False)
class LogFigures:
    """The accuracy and the cost of mapping one log."""

    translation_m: Annotated[tuple[float, float], Column("translation (m)", ".4f")]
    rotation_deg: Annotated[tuple[float, float], Column("rotation (°)", ".3f")]
    """Both are mean and standard deviation over the relations."""
    relations: Annotated[int, Column("relations")]
    lost: Annotated[int, Column("lost")]
    wall_seconds: Annotated[float, Column("wall (s)", ".1f")]
    """From opening the bag to the finished map."""
    peak_memory_mb: Annotated[float, Column("peak (MB)", ".0f")]
    """Peak of the process that made the map."""
    seconds: dict[str, float]
    """Wall time by stage; what no stage accounts for is the rest."""
    false_loops: FalseLoopFigures | None
    report: dict[str, Any] = field(repr=False)
    """As in report.json when the map was done."""


@dataclass(frozen=True)
class Published:
    """Mean errors over the relations, and wall time."""

    cartographer_translation_m: Annotated[float | None, Column("Cartographer (m)", ".4f")] = None
    cartographer_rotation_deg: Annotated[float | None, Column("Cartographer (°)", ".3f")] = None
    cartographer_seconds: Annotated[float | None, Column("Cartographer (s)", ".0f")] = None
    graph_mapping_translation_m: Annotated[float | None, Column("graph mapping (m)", ".3f")] = None
    gmapping_translation_m: Annotated[float | None, Column("GMapping (m)", ".3f")] = None


SOURCES = (
    "Cartographer: Hess et al., ICRA 2016, wall time on a six-core Xeon. "
    "Graph mapping and GMapping: Kümmerle et al., Autonomous Robots 27, 2009."
)

PUBLISHED = {
    "aces": Published(0.0375, 0.373, 41.0, 0.044, 0.060),
    "intel": Published(0.0229, 0.453, 179.0, 0.031, 0.070),
    "fr079": Published(0.0452, 0.538, 62.0, 0.056, 0.061),
}
"""By log name."""
WHOLE = "default"
_NO_WHEELS = "wheel odometry"
"""Removed from the input, not from the method."""


def slam(
    bench: Bench,
    data: DataOption = None,
    logs: Annotated[
        list[str] | None,
        typer.Option("--logs", metavar="NAME", help="Only this log; may be repeated.", show_default=False),
    ] = None,
    ablation: Annotated[bool, typer.Option("--ablation", help="Also map with one part left out.")] = False,
    false_loops: Annotated[
        bool, typer.Option("--false-loops", help="Also put as many wrong loops as true ones into the graphs.")
    ] = False,
) -> None:
    """Map the logs of the SLAM benchmark, each in a fresh process, and compare with the published figures.

    A log is a bag with a .relations file of the same name, in the folder of the recordings or its folder
    slam_benchmark.

    Example: python -m benchmarks slam --json slam.json
    """
    settings = bench.settings.mapping
    variants: dict[str, str | None] = {WHOLE: None}
    if ablation:
        variants |= {f"without {name}": name for name in (_NO_WHEELS, *PARTS)}
    found = [(log.name, log) for log in find_logs(recordings_folder(data), logs or ())]
    measure = partial(map_log, settings=settings, false_loops_seed=bench.seed if false_loops else None)
    rows = bench.cross("logs", found, variants, measure, in_fresh_processes=True)
    runs = {log: by_variant[WHOLE] for log, by_variant in rows.items()}
    bench.report.add("published", {log: asdict(PUBLISHED[log]) for log in runs if log in PUBLISHED})
    show(bench, runs)
    if ablation:
        bench.table("Mean error with one thing left out (m / °)", left_out(rows))
    if not bench.quiet:
        print_warnings(f"{log}: {each}" for log, run in runs.items() for each in run.report["warnings"])


def show(bench: Bench, runs: Mapping[str, LogFigures]) -> None:
    """Print the tables of the unchanged mapper."""
    alone = {log: replace(run, false_loops=None) for log, run in runs.items()}  # they have their own table
    bench.table(
        "Mean error over the relations ± standard deviation, and what others published",
        {log: {**cells(run), **cells(PUBLISHED.get(log, Published()))} for log, run in alone.items()},
        SOURCES,
    )
    second = Column("", ".1f")
    bench.table(
        "Wall time by stage (s)",
        {
            log: {
                stage: second.cell(seconds)
                for stage, seconds in {**run.seconds, "total": run.wall_seconds}.items()
            }
            for log, run in runs.items()
        },
    )
    if bent := {log: run.false_loops for log, run in runs.items() if run.false_loops is not None}:
        bench.table("Mean error when wrong loop closures are put into the finished graph", bent)


def left_out(rows: Mapping[str, Mapping[str, LogFigures]]) -> dict[str, dict[str, str]]:
    """Both mean errors, with a row per variant and a column per log."""
    variants = dict.fromkeys(variant for by_variant in rows.values() for variant in by_variant)
    return {
        variant: {log: _both_errors(by_variant[variant]) for log, by_variant in rows.items()}
        for variant in variants
    }


def map_log(
    log: BenchmarkLog, left_out: str | None, settings: MappingConfig, false_loops_seed: int | None
) -> LogFigures:
    """Map a log, optionally with a part left out, and measure it; with a seed, false loops are also added to
    the graph of the whole method.

    Raises UserError if the bag or the relations cannot be read.
    """
    relations = load_relations(log.relations)
    report, variant = Report("python -m benchmarks slam"), PARTS.get(left_out or "", Variant())
    with variant.in_place(), BagReader(log.bag, use_odometry=left_out != _NO_WHEELS) as reader:
        config = Config(mapping=variant.configured(settings))
        result = build_map(reader, config, RunContext(report), learns_sensors=False).result
    told = report.as_dict()
    accuracy = relation_errors(result.trajectory, relations).summary()
    false_loops = None
    if left_out is None and false_loops_seed is not None:
        false_loops = with_false_loops(result, relations, np.random.default_rng(false_loops_seed))
    wall_seconds = told["stages"]["total"]["wall_seconds"]
    seconds = {"reading": told["stages"]["reading"]["wall_seconds"], **told["mapping_seconds"]}
    return LogFigures(
        translation_m=(accuracy["translation_mean_m"], accuracy["translation_std_m"]),
        rotation_deg=(accuracy["rotation_mean_deg"], accuracy["rotation_std_deg"]),
        relations=int(accuracy["relations"]),
        lost=int(accuracy["lost"]),
        wall_seconds=wall_seconds,
        peak_memory_mb=told["peak_memory_mb"],
        seconds={**seconds, "rest": wall_seconds - sum(seconds.values())},
        false_loops=false_loops,
        report=told,
    )


def _both_errors(run: LogFigures) -> str:
    errors = f"{run.translation_m[0]:.4f} / {run.rotation_deg[0]:.3f}"
    return f"{errors} ({run.lost} lost)" if run.lost else errors
