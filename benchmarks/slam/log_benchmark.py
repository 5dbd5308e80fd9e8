"""Logs of the SLAM benchmark: mapped as a user maps them, measured against their true relations."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from benchmarks.replacements import replaced
from benchmarks.slam.false_loops import FalseLoopFigures, with_false_loops
from benchmarks.slam.logs import BenchmarkLog
from benchmarks.slam.parts import PARTS
from racecar.mapping.config import MappingConfig
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.evaluation.relations import load_relations, relation_errors
from racecar.pipelines.files.report import Report
from racecar.pipelines.runs.mapping_run import build_map
from racecar.pipelines.runs.other_process import in_fresh_process


@dataclass(frozen=True, eq=False)
class LogFigures:
    """The accuracy and the cost of mapping one log."""

    accuracy: dict[str, float]
    """As `RelationErrors.summary` has it."""
    report: dict[str, Any]
    """As report.json has it, taken when the map was done."""
    false_loops: FalseLoopFigures | None

    @property
    def wall_seconds(self) -> float:
        """From opening the bag to the finished map."""
        return float(self.report["stages"]["total"]["wall_seconds"])

    @property
    def peak_memory_mb(self) -> float:
        """Of the process that made the map."""
        return float(self.report["peak_memory_mb"])

    @property
    def seconds(self) -> dict[str, float]:
        """Wall time split by stage; what no stage accounts for is the rest."""
        reading = self.report["stages"]["reading"]["wall_seconds"]
        stages = {"reading": reading, **self.report["mapping_seconds"]}
        return {**stages, "rest": self.wall_seconds - sum(stages.values())}

    def as_dict(self) -> dict[str, Any]:
        """For a JSON file."""
        return {
            "accuracy": self.accuracy,
            "wall_seconds": self.wall_seconds,
            "peak_memory_mb": self.peak_memory_mb,
            "seconds": self.seconds,
            "report": self.report,
        }


def measure_all(
    logs: Sequence[BenchmarkLog],
    settings: MappingConfig,
    *,
    use_odometry: bool = True,
    left_out: str | None = None,
    false_loops_seed: int | None = None,
    announce: Callable[[str], None],
    quiet: bool,
) -> dict[str, LogFigures]:
    """Measure the logs one after the other, each in a fresh process; the figures by name of the log."""
    figures = {}
    for log in logs:
        announce(f"Mapping {log.name}")
        run = partial(
            measure,
            log,
            settings,
            use_odometry=use_odometry,
            left_out=left_out,
            false_loops_seed=false_loops_seed,
            quiet=quiet,
        )
        figures[log.name] = in_fresh_process(run)
    return figures


def measure(
    log: BenchmarkLog,
    settings: MappingConfig,
    *,
    use_odometry: bool,
    left_out: str | None,
    false_loops_seed: int | None,
    quiet: bool,
) -> LogFigures:
    """Map a log and measure it, where asked for without one of the `PARTS`; with a seed also with false loops
    in its graph.

    Raises UserError when the bag or the relations cannot be read.
    """
    relations = load_relations(log.relations)
    report = Report("python -m benchmarks slam")
    replacements = PARTS[left_out] if left_out else ()
    with replaced(replacements), BagReader(log.bag, use_odometry=use_odometry) as reader:
        result = build_map(reader, settings, report, quiet=quiet)
    figures = report.as_dict()
    accuracy = relation_errors(result.trajectory, relations).summary()
    false_loops = None
    if false_loops_seed is not None:
        false_loops = with_false_loops(result, relations, np.random.default_rng(false_loops_seed))
    return LogFigures(accuracy, figures, false_loops)
