"""The error of trajectories along their paths on the map, beside the reference, and over time."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import compose, inverse
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.files.pictures.colors import LINE_COLORS, TRUTH_COLOR
from racecar.pipelines.files.pictures.driven_time import DrivenTime
from racecar.pipelines.files.pictures.figure_files import add_legend, figure_for_file
from racecar.pipelines.files.pictures.grid_drawing import draw_grid, show_area
from racecar.pipelines.runs.evaluation.evaluation import TrajectoryErrors

_PANEL_COLUMNS = 3
_WIDTH = 12.5
"""Width of the figure in inches."""
_PANEL_HEIGHTS = (2.0, 9.0)
"""Smallest and largest height in inches: a straight drive is visible, and the figure fits on a page."""
_CURVES = 2.5
"""Height in inches of the errors over time, each."""
_TICKS = 18
"""Intervals between ticks over the width of the figure, so that their numbers fit beside one another."""
_MARGIN = 2.0
"""Margin in metres around the path."""
_SCALE_ENDS_AT = 0.99
"""Quantile of the errors at the end of the colour scale, so one outlier does not make the rest look alike.
Chosen by judgement."""
_SMALLEST_SCALE = 1e-3
"""Metres, so zero errors have a scale too."""


@dataclass(frozen=True, eq=False)
class MeasuredPath:
    """A path with known errors."""

    name: str
    errors: TrajectoryErrors
    grid: OccupancyGrid | None = None
    """The map under the path."""


@dataclass(frozen=True, eq=False)
class _Panel:
    """Paths in one frame."""

    title: str
    reference: NDArray[np.float64]
    """(M, 2) metres."""
    paths: Sequence[NDArray[np.float64]]
    """(M, 2) metres each."""
    grid: OccupancyGrid | None = None

    @property
    def window(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lower left and upper right of the visible area, in metres."""
        places = np.concatenate([self.reference, *self.paths])
        return places.min(axis=0) - _MARGIN, places.max(axis=0) + _MARGIN

    def draw(self, axes: Axes, most_ticks: int) -> None:
        """Map and reference."""
        if self.grid is None:
            show_area(axes, *self.window, most_ticks)
        else:
            draw_grid(axes, self.grid, *self.window, most_ticks)
        axes.set(xlabel="x (m)", ylabel="y (m)")
        axes.set_title(self.title.encode(errors="replace").decode(), loc="left", parse_math=False)
        style: dict[str, Any] = {"color": TRUTH_COLOR, "linestyle": "--", "linewidth": 1.0, "zorder": 4}
        axes.plot(*self.reference.T, label="reference", **style)


def error_picture(paths: Sequence[MeasuredPath]) -> Figure:
    """A map panel for each path, coloured by position error, with the reference; for several paths, another
    one with all of them. Below them, all errors over time."""
    panels = [_of_one(path) for path in paths]
    if len(paths) > 1:
        panels.append(_of_all(paths))
    columns = min(len(panels), _PANEL_COLUMNS)
    rows = -(-len(panels) // columns)
    tall = max(height / width for width, height in (np.subtract(*panel.window[::-1]) for panel in panels))
    height = float(np.clip(_WIDTH / columns * tall, *_PANEL_HEIGHTS)) + 1.0
    figure = figure_for_file(figsize=(_WIDTH, height * rows + 2 * _CURVES + 1.5), layout="constrained")
    layout = figure.add_gridspec(rows + 2, columns, height_ratios=[height] * rows + [_CURVES] * 2)
    axes = [figure.add_subplot(layout[n // columns, n % columns]) for n in range(len(panels))]
    for each, panel in zip(axes, panels, strict=True):
        panel.draw(each, _TICKS // columns)
    end = max(_SMALLEST_SCALE, *(float(np.quantile(path.errors.positions, _SCALE_ENDS_AT)) for path in paths))
    for each, path in zip(axes, paths, strict=False):
        colored = _draw_errors(each, path, end)
    scale: dict[str, Any] = {"orientation": "horizontal", "extend": "max", "shrink": 0.5, "aspect": 40}
    figure.colorbar(colored, ax=axes, label="error in position (m)", **scale)
    if len(paths) > 1:
        for line, color in zip(panels[-1].paths, _colors(paths), strict=True):
            axes[-1].plot(*line.T, color=color, linewidth=1.0)
    _draw_over_time([figure.add_subplot(layout[row, :]) for row in (rows, rows + 1)], paths)
    add_legend(figure, columns=1 if len(paths) > 1 else None)
    return figure


def _of_one(path: MeasuredPath) -> _Panel:
    """In the frame of its map."""
    errors = path.errors
    reference = compose(inverse(errors.reference_from_map), errors.reference_from_base)
    return _Panel(path.name, reference[:, :2], [errors.map_from_base[:, :2]], path.grid)


def _of_all(paths: Sequence[MeasuredPath]) -> _Panel:
    """In the frame of the reference, of which the longest part that one of them covers is shown."""
    covered = max((path.errors.reference_from_base for path in paths), key=len)
    aligned = [compose(path.errors.reference_from_map, path.errors.map_from_base) for path in paths]
    return _Panel("all, in the frame of the reference", covered[:, :2], [poses[:, :2] for poses in aligned])


def _draw_errors(axes: Axes, path: MeasuredPath, end: float) -> LineCollection:
    line = path.errors.map_from_base[:, :2]
    style: dict[str, Any] = {"cmap": "plasma_r", "linewidths": 3.5, "capstyle": "round", "zorder": 3}
    colored = LineCollection(list(np.stack([line[:-1], line[1:]], axis=1)), **style)
    colored.set_array(path.errors.positions[1:])
    colored.set_clim(0.0, end)
    axes.add_collection(colored, autolim=False)
    return colored


def _draw_over_time(axes: Sequence[Axes], paths: Sequence[MeasuredPath]) -> None:
    place, heading = axes
    time = DrivenTime(*(path.errors.seconds for path in paths))
    for path, color in zip(paths, _colors(paths), strict=True):
        style: dict[str, Any] = {"color": color, "linewidth": 1.0}
        errors, label = path.errors, path.name if len(paths) > 1 else None
        place.plot(*time.line(errors.seconds, errors.positions), label=label, **style)
        heading.plot(*time.line(errors.seconds, np.rad2deg(errors.headings)), **style)
    time.mark(place, heading)
    place.set(ylabel="error in position (m)", ylim=(0, None))
    place.tick_params(labelbottom=False)
    heading.set(ylabel="error in heading (°)", ylim=(0, None))
    heading.sharex(place)


def _colors(paths: Sequence[MeasuredPath]) -> list[str]:
    return [LINE_COLORS[number % len(LINE_COLORS)] for number in range(len(paths))]
