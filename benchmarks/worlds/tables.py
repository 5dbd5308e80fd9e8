"""The mapper's figures on simulated worlds, as a table."""

from collections.abc import Mapping, Sequence

import numpy as np
from rich.table import Table

from benchmarks.markdown_table import add_columns, new_table
from benchmarks.worlds.world_benchmark import WorldFigures


def worlds_table(worlds: Mapping[str, Sequence[WorldFigures]]) -> Table:
    """A row for each world: the mean over its drives, and the worst of them."""
    table = new_table(
        "Errors against the truth, mean and worst over the drives",
        "relations: pairs of scans up to 10 m apart; heading: over 100 m of path; "
        "farthest: from the first pose, as a share of the path; wheels: what odometry alone has",
    )
    errors = ("relations (m)", "worst drive (m)", "worst relation (m)", "heading (°)", "worst (°)")
    add_columns(
        table,
        "world",
        *errors,
        *("farthest (%)", "wheels (m)", "wheels (°)", "path (m)", "placed", "warnings", "verdicts", "s"),
    )
    for name, drives in worlds.items():
        found = [drive.errors for drive in drives]
        relations, headings = [each.relation_m for each in found], [each.heading_deg for each in found]
        table.add_row(
            name,
            f"{np.mean(relations):.3f}",
            f"{max(relations):.3f}",
            f"{max(each.relation_max_m for each in found):.2f}",
            f"{np.mean(headings):.2f}",
            f"{max(headings):.2f}",
            f"{100 * max(each.far_share for each in found):.2f}",
            f"{np.mean([drive.wheels.relation_m for drive in drives]):.3f}",
            f"{np.mean([drive.wheels.heading_deg for drive in drives]):.2f}",
            f"{np.mean([each.path_m for each in found]):.0f}",
            f"{sum(drive.placed for drive in drives)}/{sum(drive.scans for drive in drives)}",
            " ".join(str(len(drive.warnings)) for drive in drives),
            " ".join(drive.verdict or "–" for drive in drives),
            f"{np.mean([drive.seconds for drive in drives]):.0f}",
        )
    return table


def one_line(name: str, figures: WorldFigures) -> str:
    """A drive's errors, for who waits for the table."""
    errors = figures.errors
    return (
        f"{name}, seed {figures.seed}: {errors.relation_m:.3f} m (worst {errors.relation_max_m:.2f} m), "
        f"{errors.heading_deg:.2f}° per 100 m, {100 * errors.far_share:.2f} % of {errors.path_m:.0f} m, "
        f"{len(figures.warnings)} warnings, {figures.seconds:.0f} s"
    )
