"""Rows of figures as Markdown tables, ready to be pasted into a page.

A row is a dataclass whose figures are annotated with their columns, as in ``error_m: Annotated[float,
Column("error (m)", ".3f")]``; figures without one appear only in the JSON file.
"""

from collections.abc import Mapping
from dataclasses import dataclass, is_dataclass
from typing import Any, TypeAlias, get_args, get_type_hints

from rich import box
from rich.table import Table

Cells: TypeAlias = Mapping[str, str]
"""Cells by the title of their column."""
_UNKNOWN = "–"


@dataclass(frozen=True)
class Column:
    """The column and format of a figure."""

    title: str
    shape: str = ""
    """As for `format`. A tuple is a mean and its deviation; the items of a list are written in sequence."""

    def cell(self, value: Any) -> str:
        """A figure as text; None is unknown."""
        if isinstance(value, tuple):
            mean, deviation = value
            return f"{mean:{self.shape}} ± {deviation:{self.shape.lstrip('+')}}"
        if isinstance(value, list):
            return " ".join(map(self.cell, value))
        return _UNKNOWN if value is None else format(value, self.shape)


def cells(row: Any) -> Cells:
    """The cells of a row, if it is not cells already.

    The cells of a nested row replace it, except for titles that the row already has.
    """
    if isinstance(row, Mapping):
        return row
    written: dict[str, str] = {}
    for name, kind in get_type_hints(type(row), include_extras=True).items():
        value = getattr(row, name)
        columns = [mark for mark in get_args(kind) if isinstance(mark, Column)]
        written |= {column.title: column.cell(value) for column in columns}
        if is_dataclass(value) and not columns:
            written |= {title: cell for title, cell in cells(value).items() if title not in written}
    return written


def transposed(rows: Mapping[str, Cells]) -> dict[str, Cells]:
    """A row for each column, and a column for each row."""
    titles = dict.fromkeys(title for row in rows.values() for title in row)
    return {title: {name: row.get(title, _UNKNOWN) for name, row in rows.items()} for title in titles}


def markdown_table(title: str, rows: Mapping[str, Cells], caption: str | None = None) -> Table:
    """A column of names, and columns of figures."""
    table = Table(title=title, caption=caption, box=box.MARKDOWN)
    table.title_justify = table.caption_justify = "left"
    table.add_column("")
    titles = dict.fromkeys(title for row in rows.values() for title in row)
    for each in titles:
        table.add_column(each, justify="right")
    for name, row in rows.items():
        table.add_row(name, *(row.get(each, _UNKNOWN) for each in titles))
    return table
