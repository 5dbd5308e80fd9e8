"""Figures as tables for people."""

from rich.table import Table

from racecar.pipelines.evaluation.evaluation import TrajectoryErrors
from racecar.pipelines.evaluation.relations import RelationErrors


def trajectory_table(title: str, errors: TrajectoryErrors) -> Table:
    """Absolute and relative errors of a trajectory, one line each."""
    figures = errors.summary()
    table = _table(
        title,
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


def relations_table(title: str, errors: RelationErrors) -> Table:
    """Errors of the relative poses, as the SLAM benchmark states them."""
    figures = errors.summary()
    table = _table(
        title,
        caption=f"{figures['lost']} of {figures['relations']} relations lost",
        columns=("mean", "std", "mean square"),
    )
    for name, key, square in (("translation (m)", "_m", "_m2"), ("rotation (°)", "_deg", "_deg2")):
        kind = name.split()[0]
        values = (f"{kind}_mean{key}", f"{kind}_std{key}", f"{kind}_mean_square{square}")
        table.add_row(name, *(f"{figures[value]:.4f}" for value in values))
    return table


def demo_table(mapping: TrajectoryErrors, localization: TrajectoryErrors) -> Table:
    """Mean errors of both stages of the demo against the truth."""
    table = Table(title="Mean error against the truth", title_justify="left")
    for column in ("stage", "position (m)", "heading (°)", "poses"):
        table.add_column(column, justify="left" if column == "stage" else "right")
    for stage, missed in (("mapping", mapping), ("localization", localization)):
        figures = missed.summary()
        position, heading = figures["absolute_position_m"]["mean"], figures["absolute_heading_deg"]["mean"]
        table.add_row(stage, f"{position:.4f}", f"{heading:.3f}", f"{missed.matched} of {missed.total}")
    return table


def _table(title: str, *, caption: str, columns: tuple[str, ...]) -> Table:
    table = Table(title=title, caption=caption, title_justify="left", caption_justify="left")
    table.add_column("error")
    for column in columns:
        table.add_column(column, justify="right")
    return table
