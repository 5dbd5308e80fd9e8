"""What the terminal shows at the end of a batch."""

from collections.abc import Sequence

from rich import box
from rich.markup import escape
from rich.table import Table

from racecar.pipelines.batch.batch_page import shown
from racecar.pipelines.batch.batch_row import BatchRow, Outcome

_COLORS = {
    Outcome.GOOD: "green",
    Outcome.DOUBTFUL: "yellow",
    Outcome.WRONG: "red",
    Outcome.FAILED: "red",
    Outcome.WAITING: "dim",
}


def batch_table(rows: Sequence[BatchRow]) -> Table:
    """A line for each bag, with what fits on a terminal; the page has more."""
    table = Table(box=box.SIMPLE, pad_edge=False)
    table.add_column("bag", overflow="fold", min_width=12)
    table.add_column("verdict", no_wrap=True)
    for column in ("path\n(m)", "off per 10 m,\nin all (m)", "took\n(s)"):
        table.add_column(column, justify="right", no_wrap=True)
    table.add_column("why", overflow="fold", min_width=20)
    for row in rows:
        outcome = f"[{_COLORS[row.outcome]}]{row.outcome.value}[/]"
        errors = (row.error_per_10_m, row.error_of_whole_m)
        off = ", ".join(shown(error, 3) for error in errors if error is not None)
        numbers = (shown(row.path_m, 1), off, shown(row.seconds, 1))
        table.add_row(escape(row.name), outcome, *numbers, escape(row.reason))
    return table


def row_line(row: BatchRow, number: int, total: int) -> str:
    """What is announced when a bag is done."""
    what = f"{number}/{total} {row.name}: {row.outcome.value}"
    if not row.outcome.has_map:
        return f"{what}. {row.reason}"
    return f"{what}, {row.path_m or 0.0:.1f} m of path, {row.seconds or 0.0:.1f} s."
