"""The localizer's accuracy on recordings, as a table."""

from collections.abc import Mapping

from rich.table import Table

from benchmarks.markdown_table import add_columns, new_table
from benchmarks.recordings.recordings_benchmark import RecordingFigures


def recordings_table(runs: Mapping[str, RecordingFigures]) -> Table:
    """How far the localizer was from where scans fit best; distances are of those that agree."""
    table = new_table(
        "Recordings from an unknown start: every 50th scan beside an exhaustive match within 4 m"
    )
    distances = ("mean (m)", "largest (m)", "beyond 0.15 m")
    add_columns(table, "recording", "scans compared", *distances, "searches")
    for name, run in runs.items():
        table.add_row(
            name,
            f"{run.scans_compared}",
            f"{run.mean_m:.3f}",
            f"{run.largest_m:.3f}",
            f"{len(run.beyond)}",
            f"{run.searches}",
        )
    return table
