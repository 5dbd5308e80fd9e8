"""The localizer's accuracy on simulated drives, as tables."""

from collections.abc import Mapping

from rich.table import Table

from benchmarks.accuracy.accuracy_benchmark import FindingFigures, TrackingFigures
from benchmarks.markdown_table import add_columns, new_table


def tracking_table(runs: Mapping[str, TrackingFigures]) -> Table:
    """Errors of all scans, row by row of the benchmark."""
    table = new_table("Tracking from a known start: errors of all scans")
    errors = ("mean (m)", "95 % (m)", "largest (m)", "mean (°)", "inside the covariance's 95 %")
    add_columns(table, "drive", "drives", "scans", *errors, "scans lost", "false alarms")
    for name, run in runs.items():
        table.add_row(
            name,
            f"{run.drives}",
            f"{run.scans}",
            f"{run.mean_m:.4f}",
            f"{run.percentile_95_m:.3f}",
            f"{run.largest_m:.3f}",
            f"{run.mean_deg:.3f}",
            f"{100 * run.share_inside_95:.1f} %",
            f"{run.scans_lost}",
            f"{run.false_alarms}",
        )
    return table


def finding_table(runs: Mapping[str, FindingFigures]) -> Table:
    """How often a place was found that was not known."""
    table = new_table("Finding a place: within 0.25 m after 3 s of driving")
    add_columns(table, "start", "places", "look-alikes left out", "noticed within 1 s", "found", "median (s)")
    for name, run in runs.items():
        table.add_row(
            name,
            f"{run.places}",
            f"{run.lookalikes_left_out}",
            "" if run.noticed is None else f"{100 * run.noticed / run.places:.1f} %",
            f"{100 * run.share_found:.1f} %",
            f"{run.median_seconds:.2f}",
        )
    return table
