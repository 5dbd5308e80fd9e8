"""The files of an experiment: its figures as PNG and SVG, its tables in Markdown."""

from pathlib import Path

from rich import box
from rich.table import Table

from racecar.maps.whole_files import write_atomically
from racecar.pipelines.experiments.result import ExperimentResult, FigureTable


def save_result(name: str, result: ExperimentResult, folder: Path) -> None:
    """Write them into an existing folder. Raises UserError when the place cannot be written to."""
    with write_atomically(folder / f"{name}.md") as partial:
        partial.write_text(_markdown(result), encoding="utf-8")
    for picture in result.pictures:
        for suffix, contents in ((".png", picture.png), (".svg", picture.svg)):
            with write_atomically(folder / f"{picture.name}{suffix}") as partial:
                partial.write_bytes(contents)


def as_rich(table: FigureTable) -> Table:
    """A table for the terminal."""
    shown = Table(title=table.title, title_justify="left", box=box.MARKDOWN)
    for number, column in enumerate(table.columns):
        shown.add_column(column, justify="left" if number == 0 else "right")
    for row in table.rows:
        shown.add_row(*row)
    return shown


def _markdown(result: ExperimentResult) -> str:
    parts = [f"# {result.title}", *result.text]
    for table in result.tables:
        lines = [table.columns, ["---"] * len(table.columns), *table.rows]
        parts += [f"**{table.title}**", "\n".join(f"| {' | '.join(line)} |" for line in lines)]
    parts += [f"![{picture.shows}]({picture.name}.svg)" for picture in result.pictures]
    return "\n\n".join(parts) + "\n"
