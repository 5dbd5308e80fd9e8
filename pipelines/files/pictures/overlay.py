"""overlay.png: the path over the map, and scans drawn over it at a few moments."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from racecar.maps.grid.occupancy_grid import OccupancyGrid
from racecar.maps.trajectory import Trajectory
from racecar.pipelines.files.pictures.map_picture import (
    LOOP_COLOR,
    PATH_COLOR,
    NewFigure,
    add_legend,
    draw_ends,
    draw_grid,
    draw_title,
    figure_for_file,
    known_cells,
)
from racecar.pipelines.files.pictures.moments import Moment

_SCAN_COLOR = LOOP_COLOR
_PANEL_COLUMNS = 3
OVERLAY_DOTS_PER_INCH = 150
_SHORT_DRIVE = 60.0
"""Seconds below which moments are labelled to a tenth of a second."""
_MARGIN = 1.0
"""Metres around the known cells."""
_SMALLEST_VIEW, _LARGEST_VIEW = 3.0, 12.0
"""Metres from the car to the edge of a panel."""


def overlay(
    grid: OccupancyGrid,
    trajectory: Trajectory,
    moments: Sequence[Moment],
    title: str,
    *,
    new_figure: NewFigure = figure_for_file,
) -> Figure:
    """Draw the path over the map, and scans over it at a few moments."""
    rows = -(-len(moments) // _PANEL_COLUMNS)
    low, high = _extent(grid, trajectory)
    width, height = high - low
    map_height = float(np.clip(12.0 * height / width, 3.0, 12.0))
    figure = new_figure(figsize=(12.5, map_height + 4.0 * rows + 0.8), layout="constrained")
    layout = figure.add_gridspec(rows + 1, _PANEL_COLUMNS, height_ratios=[map_height] + [4.0] * rows)
    axes = figure.add_subplot(layout[0, :])
    draw_grid(axes, grid, (low, high))
    _draw_path(axes, trajectory, moments)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", xlabel="x (m)", ylabel="y (m)")
    draw_title(axes, title)
    digits = 1 if trajectory.stamps[-1] - trajectory.stamps[0] < _SHORT_DRIVE * 1e9 else 0
    for number, moment in enumerate(moments, start=1):
        row, column = divmod(number - 1, _PANEL_COLUMNS)
        seconds = (moment.stamp - trajectory.stamps[0]) * 1e-9
        panel = figure.add_subplot(layout[row + 1, column])
        _draw_moment(panel, grid, trajectory, moment, f"{number}: {seconds:.{digits}f} s")
    add_legend(figure, axes)
    return figure


def _draw_path(axes: Axes, trajectory: Trajectory, moments: Sequence[Moment]) -> None:
    x, y = trajectory.map_from_base[:, :2].T
    axes.plot(x, y, color=PATH_COLOR, linewidth=1.4, label="path", zorder=3)
    axes.plot([], [], ".", color=_SCAN_COLOR, label="scan")
    draw_ends(axes, trajectory, zorder=7)
    for number, moment in enumerate(moments, start=1):
        axes.annotate(
            str(number),
            (moment.map_from_base[0], moment.map_from_base[1]),
            ha="center",
            va="center",
            fontsize=8,
            color="white",
            bbox={"boxstyle": "circle", "facecolor": PATH_COLOR, "edgecolor": "white"},
            zorder=6,
        )


def _draw_moment(axes: Axes, grid: OccupancyGrid, trajectory: Trajectory, moment: Moment, title: str) -> None:
    """Draw the scan around the car, close enough to see whether it lies on the walls."""
    x, y, yaw = moment.map_from_base
    axes.plot(*trajectory.map_from_base[:, :2].T, color=PATH_COLOR, linewidth=1.0, alpha=0.6)
    axes.plot(*moment.points_in_map.T, ".", color=_SCAN_COLOR, markersize=2.2, markeredgewidth=0)
    axes.quiver(x, y, np.cos(yaw), np.sin(yaw), color=PATH_COLOR, scale=9, width=0.014, zorder=5)
    distances = np.hypot(*(moment.points_in_map - [x, y]).T)
    reach = np.quantile(distances, 0.9) if len(distances) else 0.0
    view = float(np.clip(reach, _SMALLEST_VIEW, _LARGEST_VIEW))
    draw_grid(axes, grid, (np.array([x - view, y - view]), np.array([x + view, y + view])))
    axes.set(xlim=(x - view, x + view), ylim=(y - view, y + view), aspect="equal")
    on_wall = "" if np.isnan(moment.share_on_wall) else f", {moment.share_on_wall:.0%} on walls"
    axes.set_title(f"{title}{on_wall}", fontsize=10)
    axes.tick_params(labelsize=8)


def _extent(grid: OccupancyGrid, trajectory: Trajectory) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower left and upper right of the path and of the map without its outermost cells, in metres."""
    known = grid.center_of(known_cells(grid))
    without_outliers = [0.001, 0.999]
    places = np.vstack([np.quantile(known, without_outliers, axis=0), trajectory.map_from_base[:, :2]])
    return places.min(axis=0) - _MARGIN, places.max(axis=0) + _MARGIN
