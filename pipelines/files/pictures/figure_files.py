"""Figures, and how they become files."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from racecar.maps.whole_files import write_atomically

DOTS_PER_INCH = 150
"""Resolution of pictures with several panels."""
MAP_DOTS_PER_INCH = 200
"""Resolution of pictures of a map."""
_COMPRESSION = 3
"""zlib's level. Measured on a map of 4 million cells: 0.5 s less than the usual 6, in a file larger by a
sixth."""


def figure_for_file(**options: Any) -> Figure:
    """A figure that no window shows."""
    figure = Figure(**options)
    FigureCanvasAgg(figure)
    return figure


def figure_to_show(**options: Any) -> Figure:
    """A figure that notebooks show automatically, and scripts with ``matplotlib.pyplot.show()``."""
    from matplotlib import pyplot  # may look for a display

    return pyplot.figure(**options)


NewFigure = Callable[..., Figure]
"""`figure_for_file` or `figure_to_show`."""


def add_legend(figure: Figure, columns: int | None = None) -> None:
    """Add one legend for all axes, below them, where it covers nothing; each label once, in one row or in
    ``columns``."""
    entries: dict[str, Any] = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    figure.legend(
        list(entries.values()),
        list(entries),
        loc="outside lower center",
        ncols=columns or len(entries),
        frameon=False,
    )


def save_figure(path: Path, figure: Figure, dots_per_inch: int, author: str = "racecar") -> None:
    """Write a figure as PNG, complete or not at all, with the command that made it as its author.

    Raises UserError when the file cannot be written.
    """
    _lay_out(figure, dots_per_inch)
    with write_atomically(path) as partial:
        figure.savefig(
            partial,
            format="png",
            dpi=dots_per_inch,
            metadata={"Software": author},
            pil_kwargs={"compress_level": _COMPRESSION},
        )


def _lay_out(figure: Figure, dots_per_inch: int) -> None:
    """Compute the layout once; matplotlib would draw a large grid for that, and again for the output."""
    engine = figure.get_layout_engine()
    if engine is not None:
        figure.set_dpi(dots_per_inch)
        for _ in range(2):  # as matplotlib does; tick sizes are known in the second pass
            engine.execute(figure)
        figure.set_layout_engine(None)
