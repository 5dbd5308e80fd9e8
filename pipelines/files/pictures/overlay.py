"""overlay.png: the path over the map, and scans drawn over it at a few moments."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.files.pictures.colors import LOOP_COLOR, PATH_COLOR
from racecar.pipelines.files.pictures.figure_files import NewFigure, add_legend, figure_for_file
from racecar.pipelines.files.pictures.grid_drawing import draw_grid
from racecar.pipelines.files.pictures.heading import Heading
from racecar.pipelines.files.pictures.map_picture import draw_ends
from racecar.pipelines.files.pictures.moments import Moment
from racecar.pipelines.files.pictures.shown_area import shown_area

_SCAN_COLOR = LOOP_COLOR
_WIDTH = 12.5
"""Inches of a figure whose map is above the panels."""
_PANEL = 4.0
"""Inches of a panel's side."""
_MAP_SIDES = (2.0, 9.0)
"""Smallest and largest inches of the map's shorter and longer side."""
_MARGIN = 0.2
"""Inches around everything."""
_LEGEND = 0.6
"""Inches beneath everything."""
_PANEL_TICKS = 7
"""Intervals between ticks on an axis of a panel, which is small."""
_SHORT_DRIVE = 60.0
"""Seconds below which moments are labelled to a tenth of a second."""
_SMALLEST_VIEW, _LARGEST_VIEW = 3.0, 12.0
"""Metres from the car to the edge of a panel."""


def overlay(
    grid: OccupancyGrid,
    trajectory: Trajectory,
    moments: Sequence[Moment],
    heading: Heading,
    *,
    new_figure: NewFigure = figure_for_file,
) -> Figure:
    """Draw the path over the map, and scans over it at a few moments, of which the first fits worst and the
    last one is the end."""
    low, high = shown_area(grid, trajectory.map_from_base[:, :2])
    figure, axes, panels = _laid_out(float(np.divide(*(high - low))), len(moments), heading, new_figure)
    draw_grid(axes, grid, low, high)
    axes.set(xlabel="x (m)", ylabel="y (m)")
    _draw_path(axes, trajectory, moments)
    titles = titles_of(moments, int(trajectory.stamps[0]))
    for panel, moment, title in zip(panels, moments, titles, strict=True):
        _draw_moment(panel, grid, trajectory, moment)
        panel.set_title(title, fontsize=10)
    add_legend(figure)
    return figure


def _laid_out(
    aspect: float, moments: int, heading: Heading, new_figure: NewFigure
) -> tuple[Figure, Axes, list[Axes]]:
    """A figure with axes for a map of an ``aspect`` (width to height), and for each moment: beside a map that
    is higher than wide, else beneath it."""
    is_beside = aspect < 1.0 and moments > 1
    columns = 2 if is_beside else 3
    rows = -(-moments // columns)
    if is_beside:
        map_width = max(_PANEL * rows * aspect, _MAP_SIDES[0])
        size = np.array([map_width + _PANEL * columns, _PANEL * rows])
        ratios = {"width_ratios": [map_width] + [_PANEL] * columns}
    else:
        map_height = float(np.clip(_WIDTH / aspect, *_MAP_SIDES))
        size = np.array([_WIDTH, map_height + _PANEL * rows])
        ratios = {"height_ratios": [map_height] + [_PANEL] * rows}
    title = heading.height(size[0] - 2 * _MARGIN) + _MARGIN
    whole = size + np.array([0.0, title + _LEGEND])
    figure = new_figure(figsize=whole, layout="constrained")
    engine = figure.get_layout_engine()
    assert isinstance(engine, ConstrainedLayoutEngine)
    engine.set(rect=(0.0, 0.0, 1.0, 1.0 - title / whole[1]))
    heading.draw(figure, _MARGIN, whole[1] - _MARGIN, size[0] - 2 * _MARGIN)
    right, below = (1, 0) if is_beside else (0, 1)
    layout = figure.add_gridspec(rows + below, columns + right, **ratios)
    axes = figure.add_subplot(layout[:, 0] if is_beside else layout[0, :])
    cells = [layout[number // columns + below, number % columns + right] for number in range(moments)]
    return figure, axes, [figure.add_subplot(cell) for cell in cells]


def _draw_path(axes: Axes, trajectory: Trajectory, moments: Sequence[Moment]) -> None:
    path = trajectory.map_from_base[:, :2]
    axes.plot(*path.T, color=PATH_COLOR, linewidth=1.4, label="path", zorder=3)
    axes.plot([], [], ".", color=_SCAN_COLOR, label="scan")
    draw_ends(axes, [path], zorder=7)
    number_moments(axes, moments, size=8)


def number_moments(axes: Axes, moments: Sequence[Moment], size: float) -> None:
    """Write beside the path where scans were taken, as numbers of a size in points."""
    box = {"boxstyle": "circle,pad=0.2", "facecolor": PATH_COLOR, "edgecolor": "white", "linewidth": 0.5}
    style: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "va": "center", "color": "white"}
    style["arrowprops"] = {"arrowstyle": "-", "color": PATH_COLOR, "shrinkA": 0.0, "shrinkB": 0.0}
    for number, moment in enumerate(moments, start=1):
        place = (float(moment.map_from_base[0]), float(moment.map_from_base[1]))
        axes.annotate(
            f"{number}", place, (1.5 * size, 1.5 * size), fontsize=size, bbox=box, zorder=8, **style
        )


def _draw_moment(axes: Axes, grid: OccupancyGrid, trajectory: Trajectory, moment: Moment) -> None:
    """Draw the scan around the car, close enough to see whether it lies on the walls."""
    distances = np.hypot(*(moment.points_in_map - moment.map_from_base[:2]).T)
    reach = np.quantile(distances, 0.9) if len(distances) else 0.0
    draw_scan(axes, grid, moment, float(np.clip(reach, _SMALLEST_VIEW, _LARGEST_VIEW)))
    axes.plot(*trajectory.map_from_base[:, :2].T, color=PATH_COLOR, linewidth=1.0, alpha=0.6, zorder=1.5)
    axes.tick_params(labelsize=8)


def draw_scan(axes: Axes, grid: OccupancyGrid, moment: Moment, view: float) -> None:
    """Draw a scan and the car over the map, as far as ``view`` metres."""
    place, yaw = moment.map_from_base[:2], moment.map_from_base[2]
    draw_grid(axes, grid, place - view, place + view, most_ticks=_PANEL_TICKS)
    style: dict[str, Any] = {"color": _SCAN_COLOR, "markersize": 3.0, "markeredgewidth": 0}
    axes.plot(*moment.points_in_map.T, ".", rasterized=True, **style)
    axes.quiver(*place, np.cos(yaw), np.sin(yaw), color=PATH_COLOR, scale=9, width=0.014, zorder=5)


def titles_of(moments: Sequence[Moment], begin: int) -> list[str]:
    """Number, time since ``begin`` in nanoseconds, and fit of each; the first is the worst, the latest the
    end."""
    end = max((each.stamp for each in moments), default=begin)
    digits = 1 if end - begin < _SHORT_DRIVE * 1e9 else 0
    titles = []
    for number, moment in enumerate(moments, start=1):
        marks = ["worst"] * (number == 1) + ["end"] * (moment.stamp == end)
        which = f" ({', '.join(marks)})" if marks and len(moments) > 1 else ""
        fit = "" if np.isnan(moment.share_on_wall) else f", {moment.share_on_wall:.0%} on walls"
        titles.append(f"{number}{which}: {(moment.stamp - begin) * 1e-9:.{digits}f} s{fit}")
    return titles
