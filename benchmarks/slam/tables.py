"""The mapper's figures on the SLAM benchmark and on a long drive, as tables."""

from collections.abc import Mapping

from rich.table import Table

from benchmarks.markdown_table import add_columns, new_table
from benchmarks.slam.false_loops import FalseLoopFigures
from benchmarks.slam.growth import GrowthFigures
from benchmarks.slam.log_benchmark import LogFigures
from benchmarks.slam.published import PUBLISHED, SOURCES

_UNKNOWN = "–"


def accuracy_table(runs: Mapping[str, LogFigures]) -> Table:
    """Errors and cost of each log beside the published figures."""
    table = new_table(
        "Mean error over the relations ± standard deviation, and what others published", SOURCES
    )
    ours = ("translation (m)", "rotation (°)", "relations", "lost", "wall (s)", "peak (MB)")
    cartographer = ("Cartographer (m)", "Cartographer (°)", "Cartographer (s)")
    add_columns(table, "log", *ours, *cartographer, "graph mapping (m)", "GMapping (m)")
    for log, run in runs.items():
        error = run.accuracy
        table.add_row(
            log,
            f"{error['translation_mean_m']:.4f} ± {error['translation_std_m']:.4f}",
            f"{error['rotation_mean_deg']:.3f} ± {error['rotation_std_deg']:.3f}",
            f"{error['relations']}",
            f"{error['lost']}",
            f"{run.wall_seconds:.1f}",
            f"{run.peak_memory_mb:.0f}",
            *_published(log),
        )
    return table


def stages_table(runs: Mapping[str, LogFigures]) -> Table:
    """Wall time of each log, split by stage."""
    stages = list(dict.fromkeys(stage for run in runs.values() for stage in run.seconds if stage != "rest"))
    table = new_table("Wall time by stage (s)")
    add_columns(table, "log", *stages, "rest", "total")
    for log, run in runs.items():
        seconds = [run.seconds.get(stage) for stage in (*stages, "rest")]
        cells = (_UNKNOWN if value is None else f"{value:.1f}" for value in seconds)
        table.add_row(log, *cells, f"{run.wall_seconds:.1f}")
    return table


def ablation_table(variants: Mapping[str, Mapping[str, LogFigures]]) -> Table:
    """Mean errors, a row for each variant and a column for each log."""
    logs = list(next(iter(variants.values())))
    table = new_table("Mean error with one thing left out (m / °)")
    add_columns(table, "variant", *logs)
    for variant, runs in variants.items():
        table.add_row(variant, *(_both_errors(runs[log].accuracy) for log in logs))
    return table


def false_loops_table(figures: Mapping[str, FalseLoopFigures]) -> Table:
    """Mean errors of each log without and with wrong loops in its graph."""
    table = new_table("Mean error when wrong loop closures are put into the finished graph")
    translation, rotation = ("before (m)", "after (m)", "ratio"), ("before (°)", "after (°)", "ratio")
    add_columns(table, "log", "true loops", "wrong loops", *translation, *rotation)
    for log, found in figures.items():
        table.add_row(
            log,
            f"{found.true_loops}",
            f"{found.wrong_loops}",
            f"{found.translation_before_m:.4f}",
            f"{found.translation_after_m:.4f}",
            f"{found.translation_ratio:.3f}",
            f"{found.rotation_before_deg:.3f}",
            f"{found.rotation_after_deg:.3f}",
            f"{found.rotation_ratio:.3f}",
        )
    return table


def growth_table(figures: GrowthFigures) -> Table:
    """Processor time per scan by tenth of a long drive, and what the drive costs in the end."""
    table = new_table(
        f"Processor time per scan (ms) by tenth of a drive of {1e-3 * figures.path_metres:.1f} km "
        f"with {figures.scans} scans and {figures.keyframes} keyframes, "
        f"of which {figures.keyframes_kept} are kept"
    )
    tenths = (f"{number}." for number in range(1, len(figures.milliseconds_per_scan) + 1))
    add_columns(table, "tenth", *tenths, "last / first", "MB per keyframe kept", "finish (s)")
    table.add_row(
        "scans of this tenth",
        *(f"{milliseconds:.2f}" for milliseconds in figures.milliseconds_per_scan),
        f"{figures.ratio:.2f}",
        f"{figures.megabytes_per_keyframe:.3f}",
        f"{figures.finish_seconds:.1f}",
    )
    table.add_row(
        "scans of the first, mapped anew meanwhile",
        *(f"{milliseconds:.2f}" for milliseconds in figures.early_milliseconds_per_scan),
        *[""] * 3,
    )
    table.add_row("memory added by then (MB)", *(f"{each:.0f}" for each in figures.megabytes), *[""] * 3)
    return table


def _both_errors(accuracy: Mapping[str, float]) -> str:
    errors = f"{accuracy['translation_mean_m']:.4f} / {accuracy['rotation_mean_deg']:.3f}"
    return f"{errors} ({accuracy['lost']} lost)" if accuracy["lost"] else errors


def _published(log: str) -> list[str]:
    if log not in PUBLISHED:
        return [_UNKNOWN] * 5
    figures = PUBLISHED[log]
    return [
        f"{figures.cartographer_translation_m:.4f}",
        f"{figures.cartographer_rotation_deg:.3f}",
        f"{figures.cartographer_seconds:.0f}",
        f"{figures.graph_mapping_translation_m:.3f}",
        f"{figures.gmapping_translation_m:.3f}",
    ]
