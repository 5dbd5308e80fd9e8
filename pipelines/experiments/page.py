"""The results of an experiment, for people, for programs and for the report.

Figures have the column width of a paper, and colours that colour-blind people can distinguish.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
import numpy as np
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator
from numpy.typing import NDArray

from racecar.maps.whole_files import write_atomically
from racecar.pipelines.files.pictures.colors import BLACK, BLUE, VERMILLION
from racecar.pipelines.files.pictures.figure_files import add_legend, figure_for_file

OURS, COURSE, TRUTH = BLUE, VERMILLION, BLACK
OURS_NAME, COURSE_NAME = "racecar", "course"
COLORS: Mapping[str, str] = {OURS_NAME: OURS, COURSE_NAME: COURSE}
"""By filter name."""
MAP_OF_NUMBERS = "cividis"
_COLUMN_MM, _MM_PER_INCH = 85.0, 25.4
_AXES_MM = 72.0
"""Width of the axes: that of a column minus the tick labels and the axis label."""
_DOTS_PER_INCH = 300
_TICKS_BY_DECADES = ((0.8, (1, 1.5, 2, 3, 4, 5, 6, 8)), (1.5, (1, 2, 5)), (2.5, (1, 3)), (np.inf, (1,)))
"""Ticks in each decade of a logarithmic axis that shows at most this many decades: so that two at least and
eight at most are shown."""
_STYLE: Any = {
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.titlelocation": "left",
    "axes.labelsize": 8,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.linewidth": 0.4,
    "grid.color": "#dfe3e8",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7,
    "legend.frameon": False,
    "lines.linewidth": 1.2,
    "lines.markersize": 4,
    "svg.hashsalt": "racecar",  # otherwise the ids inside an SVG differ between runs
}


class Picture(NamedTuple):
    """A rendered figure: its file name without suffix, its caption, and its bytes in both formats."""

    name: str
    shows: str
    png: bytes
    svg: bytes


class FigureTable(NamedTuple):
    """Rows of formatted figures; the columns state their units."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]


class Page:
    """The results of an experiment."""

    def __init__(self, title: str, *text: str) -> None:
        """A headline, and paragraphs on the method and the results."""
        self.title, self.text = title, list(text)
        self.tables: list[FigureTable] = []
        self.pictures: list[Picture] = []
        self.figures: dict[str, Any] = {}
        """All figures, for a JSON file; those under ``measured_times`` differ between runs."""

    def table(self, title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """Add a table for people."""
        self.tables.append(FigureTable(title, columns, rows))

    @contextmanager
    def draw(self, name: str, height_mm: float, shows: str, legend_columns: int = 0) -> Iterator[Figure]:
        """Yield a figure of a column's width; the common style applies within the block.

        It is then added, with a legend if that has columns; the same figure gives the same bytes.
        """
        with matplotlib.rc_context(_STYLE):
            figure = figure_for_file(
                figsize=(_COLUMN_MM / _MM_PER_INCH, height_mm / _MM_PER_INCH), layout="constrained"
            )
            yield figure
            if legend_columns:
                add_legend(figure, legend_columns)
            png, svg = BytesIO(), BytesIO()
            figure.savefig(png, format="png", dpi=_DOTS_PER_INCH, metadata={"Software": None})
            figure.savefig(svg, format="svg", dpi=_DOTS_PER_INCH, metadata={"Date": None, "Creator": None})
            self.pictures.append(Picture(name, shows, png.getvalue(), svg.getvalue()))

    def save(self, name: str, folder: Path) -> None:
        """Write the figures as PNG and SVG, and all else as Markdown, into an existing folder.

        Raises UserError when the files cannot be written.
        """
        parts = [f"# {self.title}", *self.text]
        for title, columns, rows in self.tables:
            lines = [columns, ["---"] * len(columns), *rows]
            parts += [f"**{title}**", "\n".join(f"| {' | '.join(line)} |" for line in lines)]
        parts += [f"![{picture.shows}]({picture.name}.svg)" for picture in self.pictures]
        files = {f"{name}.md": ("\n\n".join(parts) + "\n").encode()}
        for picture in self.pictures:
            files |= {f"{picture.name}.png": picture.png, f"{picture.name}.svg": picture.svg}
        for file, contents in files.items():
            with write_atomically(folder / file) as partial:
                partial.write_bytes(contents)


def height_of_map(low: Sequence[float], high: Sequence[float], around_mm: float) -> float:
    """Height in millimetres of a figure of a column's width that shows a map between two corners (2,), with
    ``around_mm`` for labels and a legend: no more than the map fills."""
    width, height = (float(last - first) for first, last in zip(low, high, strict=True))
    return min(_AXES_MM * height / width, _COLUMN_MM) + around_mm


def show_plain_ticks(axis: Axis, values: Sequence[float] | None = None) -> None:
    """Set plain decimal ticks on a logarithmic axis: the given ones, or some within what it shows."""
    if values is None:
        low, high = axis.get_view_interval()
        first, last = np.log10(low), np.log10(high)
        between = next(ticks for decades, ticks in _TICKS_BY_DECADES if last - first <= decades)
        values = [tick * 10.0**power for power in range(int(first) - 1, int(last) + 1) for tick in between]
    axis.set_major_locator(FixedLocator(values))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_locator(NullLocator())


def plus_minus(values: NDArray[np.float64], digits: int) -> str:
    """Mean and standard deviation of the finite values."""
    known = values[np.isfinite(values)]
    return f"{known.mean():.{digits}f} ± {known.std():.{digits}f}" if len(known) else "–"
