"""Figures as tables for people."""

import sys
from collections.abc import Iterable, Sequence
from typing import Any

from rich.console import Console, RenderableType
from rich.table import Table

_PAGE_WIDTH = 200
"""Characters of a line where tables go to a file or a pipe, so that none of their cells is broken."""


def figure_table(columns: Sequence[str], rows: Iterable[Sequence[str]], **looks: Any) -> Table:
    """Words on the left, and figures on the right of the other columns."""
    table = Table(**{"caption_justify": "left", "title_justify": "left", **looks})
    table.add_column(columns[0], overflow="fold")
    for column in columns[1:]:
        table.add_column(column, justify="right", no_wrap=True)
    for row in rows:
        table.add_row(*row)
    return table


def page(*, quiet: bool = False) -> Console:
    """Where tables are printed."""
    return Console(quiet=quiet, highlight=False, width=None if sys.stdout.isatty() else _PAGE_WIDTH)


def print_tables(*tables: RenderableType, title: str = "") -> None:
    """Tables under a title on a line of its own: one above its columns would break the path in it."""
    console = page()
    if title:
        console.print(title, style="italic", soft_wrap=True, markup=False)
    for table in tables:
        console.print(table)
