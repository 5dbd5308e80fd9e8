"""Figures as tables for people."""

from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from racecar.pipelines.evaluation.evaluation import TrajectoryErrors
    from racecar.pipelines.evaluation.relations import RelationErrors
    from racecar.pipelines.runs.trajectory_evaluation import Evaluated


def print_title(console: Console, title: str) -> None:
    """The title of a table on a line of its own: one above its columns would break the path in it."""
    console.print(title, style="italic", soft_wrap=True, markup=False, highlight=False)


def trajectory_table(errors: "TrajectoryErrors") -> Table:
    """Absolute and relative errors of a trajectory, one line each."""
    figures = errors.summary()
    table = _table(
        caption=f"{errors.matched} of {errors.total} poses compared ({errors.matched / errors.total:.1%})",
        columns=("mean", "median", "rmse", "std", "max"),
    )
    rows = {
        "absolute position (m)": figures["absolute_position_m"],
        "absolute heading (°)": figures["absolute_heading_deg"],
        "relative position (m per 1 m)": figures["relative_position_m_per_1m"],
        "relative heading (° per 1 m)": figures["relative_heading_deg_per_1m"],
    }
    for name, row in rows.items():
        values = [row[column] for column in ("mean", "median", "rmse", "std", "max")] if row else []
        table.add_row(name, *(f"{value:.4f}" for value in values))
    return table


def trajectories_table(evaluated: "Sequence[Evaluated]") -> Table:
    """Errors of several trajectories, a line for each."""
    table = Table(caption="Means, and the largest error in position.", caption_justify="left")
    table.add_column("trajectory", overflow="fold")
    for column in (
        "position\n(m)",
        "largest\n(m)",
        "heading\n(°)",
        "per 1 m\n(m)",
        "per 1 m\n(°)",
        "compared",
    ):
        table.add_column(column, justify="right", no_wrap=True)
    for each in evaluated:
        figures = each.errors.summary()
        columns = [
            (figures["absolute_position_m"], "mean"),
            (figures["absolute_position_m"], "max"),
            (figures["absolute_heading_deg"], "mean"),
            (figures["relative_position_m_per_1m"], "mean"),
            (figures["relative_heading_deg_per_1m"], "mean"),
        ]
        values = [f"{row[name]:.4f}" if row else "–" for row, name in columns]
        table.add_row(str(each.path), *values, f"{figures['matched_share']:.1%}")
    return table


def relations_table(errors: "RelationErrors") -> Table:
    """Errors of the relative poses, as the SLAM benchmark states them."""
    figures = errors.summary()
    table = _table(
        caption=f"{figures['lost']} of {figures['relations']} relations lost",
        columns=("mean", "std", "mean square"),
    )
    for name, key, square in (("translation (m)", "_m", "_m2"), ("rotation (°)", "_deg", "_deg2")):
        kind = name.split()[0]
        values = (f"{kind}_mean{key}", f"{kind}_std{key}", f"{kind}_mean_square{square}")
        table.add_row(name, *(f"{figures[value]:.4f}" for value in values))
    return table


def demo_table(mapping: "TrajectoryErrors", localization: "TrajectoryErrors") -> Table:
    """Mean errors of both stages of the demo against the truth."""
    table = Table(title="Mean error against the truth", title_justify="left")
    for column in ("stage", "position (m)", "heading (°)", "poses"):
        table.add_column(column, justify="left" if column == "stage" else "right")
    for stage, missed in (("mapping", mapping), ("localization", localization)):
        figures = missed.summary()
        position, heading = figures["absolute_position_m"]["mean"], figures["absolute_heading_deg"]["mean"]
        table.add_row(stage, f"{position:.4f}", f"{heading:.3f}", f"{missed.matched} of {missed.total}")
    return table


def _table(*, caption: str, columns: tuple[str, ...]) -> Table:
    table = Table(caption=caption, caption_justify="left")
    table.add_column("error")
    for column in columns:
        table.add_column(column, justify="right")
    return table
