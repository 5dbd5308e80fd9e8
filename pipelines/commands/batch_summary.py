"""What the terminal shows at the end of a batch."""

from collections.abc import Sequence

from rich.markup import escape
from rich.table import Table

from racecar.pipelines.batch.batch_page import figures
from racecar.pipelines.batch.batch_row import BatchRow, Outcome

_COLORS = {
    Outcome.GOOD: "green",
    Outcome.DOUBTFUL: "yellow",
    Outcome.WRONG: "red",
    Outcome.FAILED: "red",
    Outcome.WAITING: "dim",
}


def batch_table(rows: Sequence[BatchRow]) -> Table:
    """A line for each bag."""
    table = Table()
    table.add_column("bag", overflow="fold")
    table.add_column("verdict", no_wrap=True)
    units = (
        *("path\n(m)", "drive\n(s)", "off per\n10 m (m)", "off in\nall (m)"),
        *("residual\n(mm)", "loops", "took\n(s)"),
    )
    for column in units:
        table.add_column(column, justify="right", no_wrap=True)
    table.add_column("why", overflow="fold")
    for row in rows:
        outcome = f"[{_COLORS[row.outcome]}]{row.outcome.value}[/]"
        table.add_row(escape(row.name), outcome, *figures(row), escape(row.reason))
    return table


def row_line(row: BatchRow, number: int, total: int) -> str:
    """What is announced when a bag is done."""
    what = f"{number}/{total} {row.name}: {row.outcome.value}"
    if not row.outcome.has_map:
        return f"{what}. {row.reason}"
    return f"{what}, {row.path_m or 0.0:.1f} m of path, {row.seconds or 0.0:.1f} s."
