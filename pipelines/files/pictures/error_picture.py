"""The error of trajectories along their paths on the map, and over time."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from racecar.maps.geometry.se2 import Pose
from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.pipelines.files.pictures.driven_time import DrivenTime
from racecar.pipelines.files.pictures.map_picture import (
    END_COLOR,
    LOOP_COLOR,
    PATH_COLOR,
    START_COLOR,
    draw_grid,
    draw_title,
    figure_for_file,
)

ERROR_DOTS_PER_INCH = 150
_PANEL_COLUMNS = 3
_WIDTH = 12.5
"""Width of the figure in inches."""
_PANEL_HEIGHTS = (2.0, 9.0)
"""Smallest and largest height in inches: a straight drive is visible, and the figure fits on a page."""
_MARGIN = 2.0
"""Margin in metres around the path."""
_LINE_COLORS = (PATH_COLOR, LOOP_COLOR, START_COLOR, END_COLOR, "#E69F00", "#56B4E9")
_SCALE_ENDS_AT = 0.99
"""Quantile of the errors at the end of the colour scale, so one outlier does not make the rest look alike.
Chosen by judgement."""
_SMALLEST_SCALE = 1e-3
"""Metres, so zero errors have a scale too."""


@dataclass(frozen=True, eq=False)
class MeasuredPath:
    """A path with known errors."""

    name: str
    seconds: NDArray[np.float64]
    """(M,) since the start of the trajectory."""
    map_from_base: Pose
    """(M, 3)"""
    positions: NDArray[np.float64]
    """(M,) metres of error."""
    headings: NDArray[np.float64]
    """(M,) radians of error."""
    grid: OccupancyGrid | None = None
    """The map under the path."""


def error_picture(paths: Sequence[MeasuredPath]) -> Figure:
    """A map panel for each path, coloured by position error; below them, all errors over time."""
    columns = min(len(paths), _PANEL_COLUMNS)
    rows = -(-len(paths) // columns)
    tall = max(height / width for width, height in (np.subtract(*_window(path)[::-1]) for path in paths))
    panel = float(np.clip(_WIDTH / columns * tall, *_PANEL_HEIGHTS)) + 1.0
    figure = figure_for_file(figsize=(_WIDTH, panel * rows + 6.5), layout="constrained")
    layout = figure.add_gridspec(rows + 2, columns, height_ratios=[panel] * rows + [2.5, 2.5])
    end = max(_SMALLEST_SCALE, *(float(np.quantile(path.positions, _SCALE_ENDS_AT)) for path in paths))
    panels = []
    for number, path in enumerate(paths):
        panels.append(figure.add_subplot(layout[number // columns, number % columns]))
        colored = _draw_path(panels[-1], path, end)
    scale: dict[str, Any] = {"orientation": "horizontal", "extend": "max", "shrink": 0.5, "aspect": 40}
    figure.colorbar(colored, ax=panels, label="error in position (m)", **scale)
    place, heading = figure.add_subplot(layout[rows, :]), figure.add_subplot(layout[rows + 1, :])
    time = DrivenTime(*(path.seconds for path in paths))
    for number, path in enumerate(paths):
        style: dict[str, Any] = {"color": _LINE_COLORS[number % len(_LINE_COLORS)], "linewidth": 1.0}
        place.plot(*time.line(path.seconds, path.positions), label=path.name, **style)
        heading.plot(*time.line(path.seconds, np.rad2deg(path.headings)), **style)
    time.mark(place, heading)
    place.set(ylabel="error in position (m)", ylim=(0, None))
    place.tick_params(labelbottom=False)
    heading.set(ylabel="error in heading (°)", ylim=(0, None))
    heading.sharex(place)
    if len(paths) > 1:
        handles, labels = place.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", frameon=False)
    return figure


def _window(path: MeasuredPath) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower left and upper right of the visible area, in metres."""
    places = path.map_from_base[:, :2]
    return places.min(axis=0) - _MARGIN, places.max(axis=0) + _MARGIN


def _draw_path(axes: Axes, path: MeasuredPath, end: float) -> LineCollection:
    places, (low, high) = path.map_from_base[:, :2], _window(path)
    if path.grid is not None:
        draw_grid(axes, path.grid, (low, high))
    lines = np.stack([places[:-1], places[1:]], axis=1)
    colored = LineCollection(list(lines), cmap="plasma_r", linewidths=3.0, capstyle="round", zorder=3)
    colored.set_array(path.positions[1:])
    colored.set_clim(0.0, end)
    axes.add_collection(colored)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", xlabel="x (m)", ylabel="y (m)")
    draw_title(axes, path.name)
    return colored
