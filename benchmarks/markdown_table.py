"""Tables in Markdown, so that they can be pasted into a page as they are."""

from rich import box
from rich.table import Table


def new_table(title: str, caption: str | None = None) -> Table:
    """A table in Markdown."""
    table = Table(title=title, caption=caption, title_justify="left", caption_justify="left")
    table.box = box.MARKDOWN
    return table


def add_columns(table: Table, name: str, *figures: str) -> None:
    """A column of names, and columns of figures."""
    table.add_column(name)
    for figure in figures:
        table.add_column(figure, justify="right")
