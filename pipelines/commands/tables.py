"""Figures as tables for people."""

import sys
from collections.abc import Iterable, Sequence
from typing import Any

from rich.console import Console, RenderableType
from rich.table import Table

_PAGE_WIDTH = 200
"""Characters per line when tables go to a file or a pipe, so that no cell is wrapped."""


def figure_table(columns: Sequence[str], rows: Iterable[Sequence[str]], **looks: Any) -> Table:
    """A table with words on the left, and right-aligned figures in the other columns."""
    table = Table(**{"caption_justify": "left", "title_justify": "left", **looks})
    table.add_column(columns[0], overflow="fold")
    for column in columns[1:]:
        table.add_column(column, justify="right", no_wrap=True)
    for row in rows:
        table.add_row(*row)
    return table


def page(*, quiet: bool = False) -> Console:
    """The console on which tables are printed."""
    return Console(quiet=quiet, highlight=False, width=None if sys.stdout.isatty() else _PAGE_WIDTH)


def print_tables(*tables: RenderableType, title: str = "") -> None:
    """Print tables below a title on its own line, since a title of a table would wrap a path in it."""
    console = page()
    if title:
        console.print(title, style="italic", soft_wrap=True, markup=False)
    for table in tables:
        console.print(table)
